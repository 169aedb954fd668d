"""RC of a video monitor behind a tuned receiver: all that is on its frequency, for people.

It needs no framegrabber, so a person who watches keeps none from a behavior. Its holder's console shows the pictures.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from resource_pool.drivers.interface import Picture
from resource_pool.rcs.framegrabber import Framegrabber


class Monitor(Framegrabber):
    """Shows its frequency as it is: people recognize snow, interference and another robot's picture."""

    def is_wanted(self, picture: Picture, expected: str) -> bool:  # noqa: ARG002
        """Return True."""
        return True
