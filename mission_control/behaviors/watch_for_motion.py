"""Watch for motion: look through one robot's camera and say when something moves.

Source: RAM 2002, "Experiments": Scouts watch a room for anything that moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.keys import Conversation
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.messages import MotionSeen, Region
from mission_control.vision.motion_detection import MotionDetector
from resource_pool.arc_client import Frame

REPORT_EVERY_FRAMES = 30  # chosen: about once a second


class WatchParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``WatchForMotion``.

    Attributes:
        again_after_s: Motion that goes on is told again after this long, mission seconds.
    """

    again_after_s: float = 1.0


class WatchForMotion(Behavior[WatchParameters]):
    """Publishes ``MotionSeen`` under its own address; remembers its view while it is suspended."""

    parameters_type = WatchParameters

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._detector = MotionDetector()
        self._robot, self._events, self._last_told_s = "", 0, -float("inf")

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        """Adapt to what changed while others had the robot."""
        self._robot = rcs.get("scout", "") or self._robot
        self._detector.swapped_in()
        self._say()

    async def suspended(self, reason: str, by: str) -> None:
        """Say what was seen until now."""
        self.report(f"suspended: {reason} by {by}; {self._seen()}")

    def see(self, frame: Frame) -> None:
        """Look for motion in the picture, publish it as soon as it is certain, and again while it goes on."""
        pixels = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        self._robot = frame.robot
        blob = self._detector.look(pixels)
        if blob is not None and frame.captured_s >= self._last_told_s + self.parameters.again_after_s:
            self._last_told_s = frame.captured_s
            self._events += 1
            region = Region(blob.x_px, blob.y_px, blob.width_px, blob.height_px)
            self.bus.publish(self.address, Conversation.EVENTS, MotionSeen(frame.captured_s, frame.robot, region))
            self.tell(frame.robot, f"motion seen through {frame.robot} at x {blob.x_px}, y {blob.y_px}")
            self.tell_parent(self._found())
            self._say()
        elif self._detector.frames % REPORT_EVERY_FRAMES == 0:
            self._say()

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, the events, and the pictures that were too torn to judge."""
        return {**super().statistics(), "events": self._events, "frames_rejected": self._detector.rejected}

    def _found(self) -> dict[str, Any]:
        return {"robot": self._robot, "events": self._events, "last_event_s": self._last_told_s}

    def _seen(self) -> str:
        return f"{self._detector.frames} frames, {self._events} events"

    def _say(self) -> None:
        self.report(f"watching through {self._robot or 'no robot yet'}: {self._seen()}")
