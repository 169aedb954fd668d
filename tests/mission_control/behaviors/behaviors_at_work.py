"""Behaviors of the example mission at work in one process: all of the backbone is real, and people take over."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
from examples import FULL, share
from hypothesis import Phase, settings

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from backbone.placer.messages import Start
from backbone.wire import Message
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process
from resource_pool.localization import AskPose, Pose
from ui_console.model.driving import DriveWish
from ui_console.session.teleoperation import Teleoperation

FEW_MOMENTS = settings(max_examples=1 + (share(FULL) == FULL), phases=[Phase.generate], derandomize=True)
MANY_MOMENTS = settings(max_examples=share(30), phases=[Phase.generate], derandomize=True)
"""How many sequences of take-overs are played; never shrunk, which would take an hour."""

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
PEOPLE = 100  # a console's priority above every mission of these tests
Course = Callable[[Teleoperation], Awaitable[None]]


def filmed_at(mission: MissionDescription, frame_rate_hz: float) -> MissionDescription:
    """Return the mission with so many pictures a second, for behaviors that need no more."""
    grabbers = [
        msgspec.structs.replace(resource, parameters={**resource.parameters, "frame_rate_hz": frame_rate_hz})
        if resource.type == "framegrabber"
        else resource
        for resource in mission.resources
    ]
    return msgspec.structs.replace(mission, resources=tuple(grabbers))


def example(*behaviors: str, **parameters: Any) -> MissionDescription:
    """Return the example mission with only these behaviors of it, and these parameters in each of them."""
    mission = read_mission(EXAMPLES / "behaviors.xml")
    kept = [behavior for behavior in mission.behaviors if behavior.name in behaviors]
    assert len(kept) == len(behaviors), f"{behaviors} of {[behavior.name for behavior in mission.behaviors]}"
    changed = [msgspec.structs.replace(behavior, parameters={**behavior.parameters, **parameters}) for behavior in kept]
    return msgspec.structs.replace(mission, behaviors=tuple(changed))


class Person:
    """A person at a console: takes robots over, drives them about, gives them back."""

    def __init__(self) -> None:
        self.running: RunningMission | None = None
        self._courses: list[Course] = []
        self._taken = 0

    def console(self, launch: Launch, bus: Bus, clock: Clock) -> Teleoperation:
        return Teleoperation(launch, bus, clock, show=lambda _event: None, work=self._courses.pop(0), watches=False)

    async def take_over(self, robot: str, course: Course, kind: str = "drive") -> None:
        """Take the robot, drive the course, give the robot back, and return."""
        assert self.running is not None
        self._taken += 1
        name = f"console-{self._taken}"
        self._courses.append(course)
        given = {"robot": robot, "kind": kind, "priority": PEOPLE, "minimum_runtime_s": 0.1}
        await self.running.start(Start("console", name, given))
        while self.running.hosts.knows(name):
            await self.running.clock.sleep_s(0.05)


def driving(left_rad_s: float, right_rad_s: float, lasts_s: float) -> Course:
    """Return a course with these wheel speeds for this time."""

    async def course(console: Teleoperation) -> None:
        await console.wait_granted()
        until_s = console.clock.now_s() + lasts_s
        while console.clock.now_s() < until_s:
            await console.do(DriveWish(left_rad_s, right_rad_s))
            await console.clock.sleep_s(0.1)

    return course


@asynccontextmanager
async def at_work(mission: MissionDescription, person: Person | None = None) -> AsyncIterator[RunningMission]:
    """Give the mission, up, with a person who may take over."""
    somebody = person or Person()
    async with mission_in_one_process(mission, consoles={"console": somebody.console}) as running:
        somebody.running = running
        yield running


def hear(running: RunningMission, behavior: str, kind: type[Message]) -> list[Any]:
    """Return a list to which each event of the behavior will be added."""
    heard: list[Any] = []
    running.bus.subscribe(
        f"mission_control/{behavior}", Conversation.EVENTS, kind, lambda envelope: heard.append(envelope.body)
    )
    return heard


async def pose(running: RunningMission, body: str) -> Pose:
    return await running.bus.ask("resource_pool/world", AskPose(body), Pose, within_s=1.0)


async def wait_until(running: RunningMission, condition: Callable[[], Any], within_s: float) -> None:
    """Return when the condition holds; it is looked at ten times a second."""
    until_s = running.clock.now_s() + within_s
    while not condition():
        assert running.clock.now_s() < until_s, f"not within {within_s} s"
        await running.clock.sleep_s(0.1)
