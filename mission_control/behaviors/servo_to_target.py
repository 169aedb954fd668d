"""Servo to target: find the landmark, track it in the picture, and stop at a place straight before it.

``mission_control.vision`` decides on motions from pictures. This file carries the motions out, and publishes the
robot's pose relative to the landmark for localizers. A person may move or turn the robot between grants: the behavior
acquires the target again, and the approach continues at its stage.

In mission.xml: an ARC of kind ``capture`` at the camera's full rate, with a period as short as a picture's.

Source: RAM 2002, "Visual Servoing" and figure 8.
"""

from __future__ import annotations

import asyncio
import math
from typing import Annotated, TypeVar

import numpy as np
from msgspec import Meta

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.errors import Refusal
from backbone.keys import Conversation
from mission_control.behavior import BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.driver import Driver
from mission_control.messages import BehaviorStatus
from mission_control.vision.landmark import Picture
from mission_control.vision.servo_law import STOP_M, Stage
from mission_control.vision.servo_views import blobs_view, skeleton_view
from mission_control.vision.skeleton_tracking import Track, TrackingPhase
from mission_control.vision.visual_servo import FARTHEST_STOP_M, LATENCY_S, NEAREST_STOP_M, ServoStep, VisualServo
from resource_pool.arc_client import Frame, LandmarkSighting

PICTURE_PX = (320, 240)  # the size for which ``SCOUT_CAMERA`` was measured
SURE_M = 0.3  # chosen: dead reckoning over a few meters is as accurate
LEAST_SPREAD_M = 0.03  # chosen: the measured error of servoing at its place; the fit alone claims a smaller one
TELL_EVERY_S = 0.2  # chosen: localizers publish as often
MOST_TURNS = 1e6  # chosen: a month of turning
SETTLES_S = 2.0  # chosen: about half the settling time; requested again if it was too short


class UnusablePicture(Refusal):
    """The framegrabber's pictures do not have the size that the algorithm needs."""

    code = "servo.unusable_picture"
    remedy = "Use a framegrabber that delivers grey pictures of 320 by 240 pixels."


class TargetNotFound(Refusal):
    """The robot turned round several times and did not see the target."""

    code = "servo.target_not_found"
    remedy = "Bring the robot within 2.5 m of the target, where nothing hides it, or let it turn for longer."


class ServoParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``ServoToTarget``.

    Attributes:
        stop_m: Distance before the target at which to stop.
        search_turns: Number of turns without a sighting after which the behavior fails; 0: never.
        latency_s: Time from a picture's capture until its command turns the wheels.
    """

    stop_m: Annotated[float, Meta(ge=NEAREST_STOP_M, le=FARTHEST_STOP_M)] = STOP_M
    search_turns: Annotated[float, Meta(ge=0, le=MOST_TURNS)] = 3.0
    latency_s: Annotated[float, Meta(ge=0, lt=0.5)] = LATENCY_S


S = TypeVar("S", bound=ServoParameters)


class Servo(Driver[S]):
    """Base class of servoing behaviors: pictures in, commands out."""

    needs_arc = "capture"
    hands_over = frozenset({"_servo", "_acquisitions", "_counted_rad", "_told_s"})
    never = Driver.never | {UnusablePicture.code}

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._servo = self._plan()
        self.step: ServoStep | None = None
        """The decision of the last picture."""
        self._seen_s: float | None = None
        self._told_s = -math.inf
        self._fresh = asyncio.Event()
        self._unusable: UnusablePicture | None = None
        self._acquisitions = 0
        self._counted_rad = 0.0
        self._phase = TrackingPhase.ACQUIRING

    def interrupted(self) -> None:
        """Acquire the target again; see ``Driver.interrupted``."""
        self.look_anew()

    def see(self, frame: Frame) -> None:
        """Decide from this picture; ``drive_on`` carries it out. A robot that obeys nothing gets no decision."""
        if not self.is_driving:
            return
        self._fresh.set()
        if (frame.width_px, frame.height_px) != PICTURE_PX:
            self._unusable = UnusablePicture(f"{frame.rc} delivers {frame.width_px} by {frame.height_px} pixels")
            return
        pixels = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        elapsed_s = 0.0 if self._seen_s is None else max(0.0, frame.captured_s - self._seen_s)
        self.step, self._seen_s = self._servo.see(pixels, elapsed_s), frame.captured_s
        self._note_phase(frame.robot, self.step)
        self._tell_sighting(frame)
        self._show(pixels, self.step.track)

    def not_now(self) -> float:
        """Return the time that settling before the target needs; see ``Behavior.not_now``."""
        return SETTLES_S if self._servo.stage is Stage.SETTLING else 0.0

    async def suspended(self, reason: str, by: str) -> None:
        """Report the progress; see ``Behavior.suspended``."""
        self.report(f"suspended: {suspended_because(reason, by)}; {self._servo.approaches} approaches until now")

    def parameters_changed(self) -> None:
        """Begin again with the new parameters."""
        self._servo, self._counted_rad = self._plan(), 0.0
        self.look_anew()

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, and counts of sightings and approaches."""
        mine = {"acquisitions": self._acquisitions, "approaches": self._servo.approaches}
        return {**super().statistics(), **mine}

    def look_anew(self) -> None:
        """Begin again with acquisition; the robot stands still, and may have been moved."""
        self._servo.resumed()
        self.step, self._seen_s, self._phase = None, None, TrackingPhase.ACQUIRING
        self._fresh.clear()

    async def next_step(self) -> ServoStep:
        """Wait for a newer picture and return its decision.

        Raises:
            UnusablePicture: The pictures do not have the size of a Scout's.
        """
        while not self._fresh.is_set():  # ``look_anew`` may come between a picture and the end of this wait
            await self._fresh.wait()
        self._fresh.clear()
        if self._unusable is not None:
            raise self._unusable
        assert self.step is not None  # noqa: S101  a fresh picture has been processed
        return self.step

    async def follow(self, robot: str, step: ServoStep) -> None:
        """Send the command that a picture led to, and report it."""
        await self.held.move(step.command.forward_m_s, step.command.turn_rad_s)
        self.report(f"{robot} {step.stage}, {step.track.phase}, {self._servo.approaches} approaches until now")

    def has_searched(self, turns: float) -> bool:
        """Return True if the robot has made this many turns without a sighting; for 0, never."""
        self._counted_rad = min(self._counted_rad, self._servo.searched_rad)  # a sighting restarts the count
        return turns > 0 and self._servo.searched_rad - self._counted_rad >= 2 * math.pi * turns

    def search_anew(self) -> None:
        """Begin a new search: count its turns from 0."""
        self._counted_rad = self._servo.searched_rad

    def arrived(self) -> None:
        """Succeed; the report contains the robot's pose before the target."""
        pose = self.step.pose if self.step is not None else None
        at: dict[str, object] = {"approaches": self._servo.approaches}
        if pose is not None:
            at |= {"ahead_m": pose.ahead_m, "left_m": pose.left_m, "heading_rad": pose.heading_rad}
        self.finish(BehaviorStatus.SUCCESS, at)

    def _show(self, pixels: Picture, track: Track) -> None:
        sighting, model = track.sighting, self._servo.tracker.model
        self.views.picture("blobs", lambda: blobs_view(pixels, None if sighting is None else sighting.blobs_px))
        self.views.picture("skeleton", lambda: skeleton_view(pixels, model))
        self.views.value("match", track.match)
        self.views.value("phase", track.phase)

    def _plan(self) -> VisualServo:
        return VisualServo(stop_m=self.parameters.stop_m, latency_s=self.parameters.latency_s)

    def _tell_sighting(self, frame: Frame) -> None:
        """Publish the pose before the landmark for localizers, if it is accurate enough; a few times a second."""
        pose = None if self.step is None else self.step.pose
        if pose is None or self._servo.spread_m > SURE_M or frame.captured_s < self._told_s + TELL_EVERY_S:
            return
        self._told_s = frame.captured_s
        sighting = LandmarkSighting(
            frame.captured_s,
            frame.robot,
            pose.ahead_m,
            pose.left_m,
            pose.heading_rad,
            max(LEAST_SPREAD_M, self._servo.spread_m),
        )
        self.bus.publish(self.address, Conversation.SIGHTINGS, sighting)

    def _note_phase(self, robot: str, step: ServoStep) -> None:
        if step.track.phase is self._phase:
            return
        if self._phase is TrackingPhase.ACQUIRING:
            self._acquisitions += 1
        self.story.note(robot, f"the target: {self._phase} → {step.track.phase}")
        self._phase = step.track.phase


class ServoToTarget(Servo[ServoParameters]):
    """Succeeds at its place before the landmark; fails if it does not find the landmark."""

    parameters_type = ServoParameters

    async def drive_on(self, robot: str) -> None:
        """Carry out the decision of each picture; see ``Driver.drive_on``."""
        self.report(f"{robot} waits for its first picture")
        while True:
            step = await self.next_step()
            if self.has_searched(self.parameters.search_turns):
                if not await self.halted(self.parameters):
                    continue
                turns = f"{self.parameters.search_turns:g}"
                self.give_up(TargetNotFound(f"{robot} saw no target in {turns} turns"))
                return
            given = self.parameters
            await self.follow(robot, step)
            if step.stage is Stage.ARRIVED and await self.halted(given):
                self.arrived()
                return
