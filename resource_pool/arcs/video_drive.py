"""ARC kind 2: drive a robot that broadcasts video, to be viewed on a monitor.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from resource_pool.arcs.drive import DriveArc
from resource_pool.commands import SwitchTransmitter


class VideoDriveArc(DriveArc):
    """A robot, a share of its command radio, and a video frequency on which it transmits during a grant."""

    roles: ClassVar[Mapping[str, str] | Sequence[str]] = (*DriveArc.roles, "video_frequency")

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Switch the robot's transmitter on; when the set is given back the radio switches it off."""
        switch = SwitchTransmitter(True, self.rc("video_frequency"))
        await self.tell_rc(self.body, epochs[self.rc(self.body)], switch)
