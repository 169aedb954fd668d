"""RC of a video monitor behind a tuned receiver: shows people every picture on its frequency.

A monitor needs no framegrabber, so a watching person leaves the framegrabbers to behaviors. The holder's console shows
the pictures.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from resource_pool.drivers.interface import Picture
from resource_pool.rcs.framegrabber import Framegrabber


class Monitor(Framegrabber):
    """Delivers every picture: people recognize snow, interference and another robot's picture by themselves."""

    def is_wanted(self, picture: Picture, expected: str) -> bool:  # noqa: ARG002
        """Return True."""
        return True
