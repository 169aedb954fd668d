"""An ARC of two cameras, one of which pans, each with its own video frequency and monitor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from resource_pool.arcs.capture import CaptureArc
from resource_pool.commands import Command, Halt
from resource_pool.devices.pan_camera.rc import Look

EYES = ("pan", "fixed")


class TwoCamerasArc(CaptureArc):
    """Two RCs of one kind under one ARC; pictures of the fixed one go out under its role."""

    roles: ClassVar[Mapping[str, str]] = {"command_radio": "command_radio"} | {
        f"{eye}{part}": kind
        for eye in EYES
        for part, kind in (("", "camera"), ("_video", "video_frequency"), ("_screen", "monitor"))
    }
    commands: ClassVar[Mapping[type[Command], str]] = {Look: "pan", Halt: "pan"}
    body = "pan"

    @classmethod
    def cameras(cls) -> Mapping[str, tuple[str, str]]:
        """Return each camera with its frequency and monitor."""
        return {eye: (f"{eye}_video", f"{eye}_screen") for eye in EYES}
