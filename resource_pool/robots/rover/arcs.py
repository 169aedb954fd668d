"""ARC kinds of a rover: drive it, or drive it and capture its video."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import msgspec

from resource_pool.arcs.capture import CaptureArc
from resource_pool.arcs.drive import DriveArc
from resource_pool.commands import Command, Halt, Move
from resource_pool.messages import DEFAULT_DRIVE_USAGE
from resource_pool.robots.rover.rc import Grip


class RoverDriveArc(DriveArc):
    """A rover and a share of its command radio."""

    roles: ClassVar[Sequence[str]] = ("rover", "command_radio")
    commands: ClassVar[Mapping[type[Command], str]] = dict.fromkeys((Move, Halt, Grip), "rover")
    body = "rover"
    # Measured: 4.34 ms at 115.2 kbit/s, the reply included.
    usage = msgspec.structs.replace(DEFAULT_DRIVE_USAGE, packet_time_s=0.005)


class RoverCaptureArc(CaptureArc):
    """A rover, its radio and video frequency, and a framegrabber tuned to it."""

    roles: ClassVar[Sequence[str]] = (*RoverDriveArc.roles, "video_frequency", "framegrabber")
    commands = RoverDriveArc.commands
    body = "rover"
    usage = RoverDriveArc.usage
