"""RC of a video frequency: exclusive, because two transmitters on one frequency make both useless.

The frequency is no device of its own. The holder of its RC has the right to transmit on it; robot and receiver do the
rest.

Source: IROS 2001, section 2.
"""

from __future__ import annotations

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from resource_pool.resource_controller import RcParameters, ResourceController


class VideoFrequency(ResourceController[RcParameters]):
    """The right to transmit on one frequency."""

    driver_kind = "video_frequency"

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.make_driver()
