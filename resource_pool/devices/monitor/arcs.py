"""ARC kind 2 of the papers with its monitor: drive a robot that broadcasts video for a person.

Source: RAM 2002, "Examples of ARCs and RCs".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from resource_pool.arcs.capture import CaptureArc
from resource_pool.arcs.video_drive import VideoDriveArc


class MonitorDriveArc(CaptureArc):
    """A robot, its radio and video frequency, and a monitor tuned to it."""

    roles: ClassVar[Sequence[str]] = (*VideoDriveArc.roles, "monitor")
    receiver = "monitor"
