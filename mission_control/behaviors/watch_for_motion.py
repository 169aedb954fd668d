"""Watch for motion: look through one robot's camera and say when something moves.

Source: RAM 2002, "Experiments": Scouts watch a room for anything that moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
import numpy as np

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.keys import Conversation
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behavior_tree import ArcNeed
from mission_control.behaviors.run_times import useful_run_times
from mission_control.messages import MotionSeen, Region
from mission_control.vision.motion_detection import FAST_FRAMES, VOTES, MotionDetector
from resource_pool.arc_client import Frame

REPORT_EVERY_FRAMES = 30  # chosen: about once a second


class WatchParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``WatchForMotion``.

    Attributes:
        again_after_s: Motion that goes on is told again after this long, mission seconds.
        frames_wanted: Pictures of one slice in which the detector is certain of motion, before it is told.
        view_s: Shortest time for which what is looked for is in view, mission seconds; above 0 the behavior works
            out the run times it asks for, none longer than the tree's; 0: it asks for those of the tree.
        settling_s: Time from a switch to the first picture, mission seconds; for that.
        frame_rate_hz: Pictures a second; for that.
        clean_share: Share of the pictures that tell something, above 0 to 1; for that.
    """

    again_after_s: float = 1.0
    frames_wanted: Annotated[int, msgspec.Meta(ge=1)] = 1
    view_s: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    settling_s: Annotated[float, msgspec.Meta(ge=0)] = 0.3
    frame_rate_hz: Annotated[float, msgspec.Meta(gt=0)] = 15.0
    clean_share: Annotated[float, msgspec.Meta(gt=0, le=1)] = 0.75


class WatchForMotion(Behavior[WatchParameters]):
    """Publishes ``MotionSeen`` under its own address; remembers its view while it is suspended."""

    parameters_type = WatchParameters

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._detector = MotionDetector()
        self._robot, self._events, self._last_told_s = "", 0, -float("inf")
        self._certain_frames, self._told_in_slice = 0, False

    def need(self) -> ArcNeed | None:
        """Claim for as long as is of use for what is looked for."""
        need, given = super().need(), self.parameters
        if need is None or given.view_s == 0:
            return need
        times = useful_run_times(
            view_s=given.view_s,
            settling_s=given.settling_s,
            blind_s=FAST_FRAMES / given.frame_rate_hz,
            detect_s=self._frames_s(VOTES - 1 + given.frames_wanted),
            given_s=need.minimum_runtime_s,
        )
        return msgspec.structs.replace(need, minimum_runtime_s=times.minimum_s, maximum_runtime_s=times.maximum_s)

    def not_now(self) -> float:
        """Ask for more if something was glimpsed and is not certain yet; what is told needs no more."""
        if self._told_in_slice or not self._detector.has_glimpsed:
            return 0.0
        return self._frames_s(max(1, self.parameters.frames_wanted - self._certain_frames))

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        """Adapt to what changed while others had the robot."""
        self._robot = rcs.get("scout", "") or self._robot
        self._detector.swapped_in()
        self._certain_frames, self._told_in_slice = 0, False
        self._say()

    async def suspended(self, reason: str, by: str) -> None:
        """Say what was seen until now."""
        self.report(f"suspended: {reason} by {by}; {self._seen()}")

    def see(self, frame: Frame) -> None:
        """Look for motion in the picture, publish it as soon as it is certain, and again while it goes on."""
        pixels = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        self._robot = frame.robot
        blob = self._detector.look(pixels)
        self._certain_frames += blob is not None
        is_certain = blob is not None and self._certain_frames >= self.parameters.frames_wanted
        if blob is not None and is_certain and frame.captured_s >= self._last_told_s + self.parameters.again_after_s:
            self._last_told_s, self._told_in_slice = frame.captured_s, True
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

    def _frames_s(self, clean_frames: int) -> float:
        """Return how long it takes until there are so many pictures that tell something."""
        return clean_frames / (self.parameters.frame_rate_hz * self.parameters.clean_share)

    def _found(self) -> dict[str, Any]:
        return {"robot": self._robot, "events": self._events, "last_event_s": self._last_told_s}

    def _seen(self) -> str:
        return f"{self._detector.frames} frames, {self._events} events"

    def _say(self) -> None:
        self.report(f"watching through {self._robot or 'no robot yet'}: {self._seen()}")
