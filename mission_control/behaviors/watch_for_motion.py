"""Watch for motion: detect motion in the pictures of one robot and publish it.

Source: RAM 2002, "Experiments": Scouts watch a room for motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from random import Random
from typing import Annotated

import msgspec
import numpy as np

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.mission.behavior_nodes import ArcNeed
from backbone.naming import Subsystem, address
from backbone.ranges import A_DAY_S
from backbone.spoken import counted
from backbone.wire import Message
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.run_times import RunTimes, useful_run_times
from mission_control.messages import GreyPicture, MotionSeen, PictureJudged, Region, SwappedIn
from mission_control.modules.orders import output_address
from mission_control.vision.motion_detection import FAST_FRAMES, VOTES, MotionDetector
from resource_pool.arc_client import Frame

PICTURE, SWAPPED_IN, JUDGED = "picture", "swapped_in", "judged"  # keys that the modules' classes declare
BRIGHTER = 4  # chosen: the least difference that counts, 28 grey levels, is clearly visible
REPORT_EVERY_FRAMES = 30  # chosen: about once a second
MOST_FRAMES = 1_000  # chosen: a minute of video
LEAST_HZ, MOST_HZ = 0.5, 1_000.0  # chosen: slower is no video, faster no camera
LEAST_CLEAN = 0.05  # chosen: of worse pictures no motion is certain


class WatchParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``WatchForMotion``.

    Attributes:
        again_after_s: Time after which continuing motion is published again, mission seconds.
        frames_wanted: Number of pictures of one slice with certain motion before it is published.
        view_s: Shortest time for which a target is in view, mission seconds. Above 0: the behavior computes its run
            times, which are at most the tree's. 0: it requests the tree's run times.
        settling_s: Time from a context switch to the first picture, mission seconds; used with view_s.
        frame_rate_hz: Pictures a second; used with view_s.
        clean_share: Share of usable pictures, 0.05 to 1; used with view_s.
        seed: Seed of the random run times.
        vision: Name of the execution unit that analyzes the pictures; empty: the behavior analyzes them itself.
    """

    again_after_s: Annotated[float, msgspec.Meta(le=A_DAY_S)] = 1.0
    frames_wanted: Annotated[int, msgspec.Meta(ge=1, le=MOST_FRAMES)] = 1
    view_s: Annotated[float, msgspec.Meta(ge=0, le=A_DAY_S)] = 0.0
    settling_s: Annotated[float, msgspec.Meta(ge=0, le=A_DAY_S)] = 0.3
    frame_rate_hz: Annotated[float, msgspec.Meta(ge=LEAST_HZ, le=MOST_HZ)] = 15.0
    clean_share: Annotated[float, msgspec.Meta(ge=LEAST_CLEAN, le=1)] = 0.75
    seed: int = 0
    vision: Annotated[str, msgspec.Meta(extra_json_schema={"names": "unit"})] = ""


class WatchForMotion(Behavior[WatchParameters]):
    """Publishes ``MotionSeen`` under its own address; keeps the average picture while it is suspended.

    With a unit for its vision, it publishes its pictures for modules (``GreyPicture`` under ``picture``, ``SwappedIn``
    under ``swapped_in``), and acts on their result for each picture (``PictureJudged`` under the unit's ``judged``).
    """

    parameters_type = WatchParameters
    fixed = Behavior.fixed | {"view_s", "settling_s", "frame_rate_hz", "clean_share", "seed", "vision"}
    hands_over = frozenset({"_detector", "_pictures", "_rejected", "_robot", "_events", "_last_told_s"})

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._detector = MotionDetector()
        self._pictures = self._rejected = 0
        self._robot, self._events, self._last_told_s = "", 0, -float("inf")
        self._certain_frames, self._told_in_slice = 0, False
        self._times: RunTimes | None = None
        self._dice = Random(f"{self.name} {self.parameters.seed}")
        self._asked_until_s = self._longest_until_s = 0.0
        self._maximum_s = 0.0

    def need(self) -> ArcNeed | None:
        """Claim with the computed run times."""
        need, given = super().need(), self.parameters
        if need is not None and given.view_s > 0:
            self._times = run_times(given, need.minimum_runtime_s)
            need = msgspec.structs.replace(
                need,
                minimum_runtime_s=self._times.drawn_s(self._dice),
                maximum_runtime_s=self._times.maximum_s,
            )
        self._maximum_s = need.maximum_runtime_s if need is not None else 0.0
        return need

    async def connect(self) -> None:
        """Subscribe to the unit that analyzes the pictures."""
        await super().connect()
        if self.parameters.vision:
            at = output_address(address(Subsystem.MISSION_CONTROL, self.parameters.vision), JUDGED)
            self.bus.subscribe(at, Conversation.OUTPUTS, PictureJudged, lambda judged: self._take_in(judged.body))

    async def resumed(self, rcs: Mapping[str, str]) -> None:  # noqa: ARG002
        """Adapt to changes since the last grant, and draw the next run time."""
        self._robot = self.robot or self._robot
        self._detector.swapped_in()
        if self.parameters.vision:
            self._publish(SWAPPED_IN, SwappedIn(self.clock.now_s()))
        self._certain_frames, self._told_in_slice = 0, False
        self._longest_until_s = self.clock.now_s() + self._maximum_s
        granted = self.arc.granted if self.arc is not None else None
        self._asked_until_s = granted.until_s if granted is not None else 0.0
        if self._times is not None and self._times.shortest_s < self._times.longest_s:
            self.start_task(self._ask_next_for(self._times.drawn_s(self._dice)), "run time")
        self._say()

    async def suspended(self, reason: str, by: str) -> None:
        """Report the counts."""
        self.report(f"suspended: {suspended_because(reason, by)}; {self._seen()}")

    def see(self, frame: Frame) -> None:
        """Analyze the picture, in the modules or here."""
        self._robot, self._pictures = frame.robot, self._pictures + 1
        if self._pictures % REPORT_EVERY_FRAMES == 0:
            self._say()
        if self.parameters.vision:
            size = frame.width_px, frame.height_px
            self._publish(PICTURE, GreyPicture(frame.robot, frame.captured_s, *size, frame.pixels))
            return
        rejected = self._detector.rejected
        blob = self._detector.look(np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px))
        self._show_stages()
        region = None if blob is None else Region(blob.x_px, blob.y_px, blob.width_px, blob.height_px)
        is_rejected = self._detector.rejected > rejected
        self._take_in(PictureJudged(frame.captured_s, frame.robot, list(self._detector.votes), region, is_rejected))

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, the events, and the number of pictures too torn to use."""
        return {**super().statistics(), "events": self._events, "frames_rejected": self._rejected}

    def _publish(self, key: str, message: Message) -> None:
        self.bus.publish(output_address(self.address, key), Conversation.OUTPUTS, message)

    def _take_in(self, judged: PictureJudged) -> None:
        """Publish motion when it is certain, and again while it continues; after a glimpse extend the slice."""
        region, at_s = judged.region, judged.captured_s
        self._rejected += judged.is_rejected
        self._certain_frames += region is not None
        is_certain = region is not None and self._certain_frames >= self.parameters.frames_wanted
        if region is not None and is_certain and at_s >= self._last_told_s + self.parameters.again_after_s:
            self._last_told_s, self._told_in_slice = at_s, True
            self._events += 1
            self.bus.publish(self.address, Conversation.EVENTS, MotionSeen(at_s, judged.robot, region))
            what = f"motion seen through {judged.robot} at x {region.x_px}, y {region.y_px}"
            self.publish_event(judged.robot, what, LogLevel.NOTICE)
            self.tell_parent(self._found())
            self._say()
        self._ask_for_more(at_s, judged.votes)

    def _show_stages(self) -> None:
        stages, views = self._detector.stages, self.views
        if stages is not None:  # the first pictures of a slice are not analyzed
            views.picture("difference", lambda: BRIGHTER * stages.difference)
            views.picture("changed", lambda: 127 * (stages.changed.astype(np.uint8) + stages.kept))
            views.value("threshold", stages.bar)
            views.value("votes", sum(self._detector.votes))

    def _ask_for_more(self, captured_s: float, votes: Sequence[bool]) -> None:
        """If there was a glimpse of motion that is not published yet, extend the slice until the motion is certain."""
        if self._told_in_slice or not votes or not votes[-1]:
            return
        missing = max(0, VOTES - 1 - sum(votes)) + max(1, self.parameters.frames_wanted - self._certain_frames)
        until_s = min(captured_s + frames_s(self.parameters, missing + 1), self._longest_until_s)
        if until_s > self._asked_until_s:
            self._asked_until_s = until_s
            self.start_task(self._ask_until(until_s), "longer")

    async def _ask_until(self, until_s: float) -> None:
        assert self.arc is not None  # noqa: S101  pictures come through the ARC
        try:
            await self.arc.want_longer(until_s)
        except (Refusal, LinkError) as error:  # then the slice ends as planned
            self.story.note(self.arc.arc, f"its slice was not extended: {error}")

    async def _ask_next_for(self, minimum_s: float) -> None:
        assert self.arc is not None  # noqa: S101  it was granted
        try:
            await self.arc.want_runtime(minimum_s, self._maximum_s)
        except (Refusal, LinkError) as error:  # then the next slice is as long as this one
            self.story.note(self.arc.arc, f"its run time was not changed: {error}")

    def _found(self) -> dict[str, object]:
        return {"robot": self._robot, "events": self._events, "last_event_s": self._last_told_s}

    def _seen(self) -> str:
        return f"{counted(self._pictures, 'frame')}, {counted(self._events, 'event')}"

    def _say(self) -> None:
        self.report(f"watching through {self._robot or 'no robot yet'}: {self._seen()}")


def run_times(given: WatchParameters, given_s: float) -> RunTimes:
    """Return the best run times for a target that is in view for ``given.view_s``.

    Args:
        given_s: Run time in the mission file, seconds.

    Raises:
        ValueError: ``view_s`` is not finite, or ``given_s`` is not above 0.
    """
    return useful_run_times(
        view_s=given.view_s,
        settling_s=given.settling_s,
        blind_s=FAST_FRAMES / given.frame_rate_hz,
        frame_s=frames_s(given, 1),
        detect_s=frames_s(given, VOTES - 1 + given.frames_wanted),
        given_s=given_s,
    )


def frames_s(given: WatchParameters, sound_frames: int) -> float:
    """Return the mean time until this many usable pictures, seconds."""
    return sound_frames / (given.frame_rate_hz * given.clean_share)
