"""RC of a video frequency: exclusive, because two transmitters on one frequency make both useless.

The frequency is no device of its own. Holding its RC is the right to transmit on it; robot and
receiver do the rest.

Source: IROS 2001, section 2.
"""

from __future__ import annotations

from resource_pool.resource_controller import RcParameters, ResourceController


class VideoFrequency(ResourceController[RcParameters]):
    """The right to transmit on one frequency."""
