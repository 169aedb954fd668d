"""ARC kind 3: drive a robot that broadcasts video, and capture it for processing.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import ClassVar

from resource_pool.arcs.video_drive import VideoDriveArc
from resource_pool.messages import Tune


class CaptureArc(VideoDriveArc):
    """A robot, its radio and video frequency, and a framegrabber tuned to it; frames go out under its address."""

    roles: ClassVar[Sequence[str]] = ("scout", "command_radio", "video_frequency", "framegrabber")

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Switch the transmitter on and tune, at the same time."""
        tune = Tune(self.name, epochs[self.rc("framegrabber")], self.rc("video_frequency"), self.rc("scout"))
        await asyncio.gather(super().prepare(epochs), self.tell_rc("framegrabber", tune))
