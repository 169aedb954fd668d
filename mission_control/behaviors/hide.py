"""Hide: find a dark place by pictures alone, drive into it, and look out of it.

In mission.xml: an ARC of kind ``capture``. A slice of at least eight seconds, long enough for a look around, is best.
If the slice is shorter, and the robot still stands at its place in the next slice, the look around continues there.
"""

from __future__ import annotations

import asyncio
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from mission_control.behavior import BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.dark_search import VIEW_COLUMNS, VIEW_ROWS, DarkSearch, SearchStage, glimpse
from mission_control.behaviors.driver import Driver
from mission_control.behaviors.motion import FARTHEST_M, STILL, DrivingSpeed, Times
from mission_control.behaviors.servo_to_target import UnusablePicture
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import Frame


class HideParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Hide``.

    Attributes:
        dark_level: Floor darker than this is dark: a grey level.
        leg_m: Distance to drive before the next look around.
        speed_m_s: Speed of driving.
        looks: Number of looks around after which it fails; 0: never.
    """

    dark_level: Annotated[float, Meta(gt=0, lt=255)] = 60.0
    leg_m: Annotated[float, Meta(gt=0, le=FARTHEST_M)] = 0.6
    speed_m_s: DrivingSpeed = 0.2
    looks: Times = 20


class HideMemory(Struct, frozen=True):
    """Progress of a search: the number of looks around."""

    looks: int


class Hide(Driver[HideParameters]):
    """Succeeds in a dark place; fails if it finds no dark place."""

    parameters_type = HideParameters
    hands_over = frozenset({"search"})
    memory_type = HideMemory
    needs_arc = "capture"
    never = Driver.never | {UnusablePicture.code}

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.search = self._plan()
        """The state of the search."""
        self._motion = STILL
        self._fresh = asyncio.Event()
        self._unusable: UnusablePicture | None = None

    def see(self, frame: Frame) -> None:
        """Decide from this picture; ``drive_on`` carries it out. A robot that obeys nothing gets no decision."""
        if not self.is_driving:
            return
        self._fresh.set()
        if frame.width_px < VIEW_COLUMNS or frame.height_px < VIEW_ROWS:
            self._unusable = UnusablePicture(f"{frame.rc} delivers {frame.width_px} by {frame.height_px} pixels")
            return
        pixels = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        seen = glimpse(pixels)
        self._motion = self.search.decide(seen, frame.captured_s)
        self.views.picture("glimpse", lambda: seen.view)
        self.views.value("ahead", seen.ahead)
        self.views.value("ground", seen.ground)

    async def drive_on(self, robot: str) -> None:
        """Carry out the decision of each picture; see ``Driver.drive_on``."""
        while not (self.search.is_final and await self.halted(self.parameters)):
            self.report(f"{robot} {self.search.stage}, {self._seen()}")
            self.keep_memory()
            await self._fresh.wait()
            self._fresh.clear()
            if self._unusable is not None:
                raise self._unusable
            await self.move(self._motion)
        is_hidden = self.search.stage is SearchStage.HIDDEN
        self.finish(BehaviorStatus.SUCCESS if is_hidden else BehaviorStatus.FAILURE, {"looks": self.search.looks})

    def interrupted(self) -> None:
        """Keep the views; the next pictures show whether the robot still stands at its place; see ``Driver``."""
        self.search.interrupt()
        self._motion = STILL
        self._fresh.clear()

    async def suspended(self, reason: str, by: str) -> None:
        """Report the looks around; see ``Behavior.suspended``."""
        self.report(f"suspended: {suspended_because(reason, by)}; {self._seen()}")

    def memory(self) -> HideMemory:
        """Return the looks around; see ``BehaviorHooks.memory``."""
        return HideMemory(self.search.looks)

    def recall(self, memory: HideMemory) -> None:
        """Begin the next look around."""
        self.search.looks = memory.looks

    def parameters_changed(self) -> None:
        """Begin again with the new parameters."""
        self.search = self._plan()

    def statistics(self) -> dict[str, float]:
        """Return the base's counters and the looks around."""
        return {**super().statistics(), "looks": self.search.looks}

    def _plan(self) -> DarkSearch:
        given = self.parameters
        return DarkSearch(dark_level=given.dark_level, leg_m=given.leg_m, speed_m_s=given.speed_m_s, looks=given.looks)

    def _seen(self) -> str:
        return f"{self.search.looks} looks around until now"
