"""The watchers see the target move through rendered pictures, and nothing else."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest
from running_mission import MISSION_XML, RunningMission, mission_up

from backbone.bus.interface import Bus
from backbone.component.messages import AskStatistics, Statistics
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from backbone.wire import Envelope
from mission_control.messages import MotionSeen
from mission_control.vision.motion_detection import LEAST_DIFFERENCE, SLOW_WEIGHT
from resource_pool.drivers.world_messages import WorldState
from resource_pool.localization import AskPose, Pose
from resource_pool.messages import Frame
from scout_model.description import RobotPlace, Target, WorldDescription
from scout_model.dimensions import FRAMES_PER_S, HORIZONTAL_VIEW_RAD, PIONEER_RADIUS_M
from scout_model.targets import where

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

BEGIN = 'begin-s="5"'
FORGOTTEN_AFTER = math.ceil(math.log(LEAST_DIFFERENCE / 255) / math.log(1 - SLOW_WEIGHT))  # pictures, white on black
STEP_S = 0.05
STANDS_M = 1e-6
SETTLED_S = 20.0
FIRST_EVENT_WITHIN_S = 90.0  # a round of the target takes 52 s


@dataclass
class Seen:
    """What was published while the mission ran.

    Attributes:
        events: Motion events, in order.
        pictures: Delivered pictures, as mission time of the capture and robot; empty text for garbage.
        world_began_s: Mission time at the world's time 0.
        first: Set with the first motion event.
    """

    events: list[MotionSeen] = field(default_factory=list)
    pictures: list[tuple[float, str]] = field(default_factory=list)
    world_began_s: float = math.nan
    first: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def robots(self) -> set[str]:
        return {robot for _captured_s, robot in self.pictures}

    def motion(self, heard: Envelope[Any]) -> None:
        self.events.append(heard.body)
        self.first.set()

    def picture(self, heard: Envelope[Any]) -> None:
        self.pictures.append((heard.body.captured_s, heard.body.robot))

    def remembers_since_s(self, event: MotionSeen) -> float:
        """Return the mission time of the oldest picture that the running average had not forgotten at the event."""
        earlier = [at_s for at_s, robot in self.pictures if robot == event.robot and at_s <= event.at_s]
        return min(sorted(earlier)[-FORGOTTEN_AFTER:], default=event.at_s)


@asynccontextmanager
async def observed(mission: RunningMission) -> AsyncIterator[tuple[Bus, Seen]]:
    seen = Seen()

    def world_moved(envelope: Envelope[Any]) -> None:
        seen.world_began_s = envelope.body.at_s - envelope.body.frame / FRAMES_PER_S

    async with mission.bus() as bus:
        bus.subscribe("mission_control/*", Conversation.EVENTS, MotionSeen, seen.motion)
        bus.subscribe("resource_pool/*", Conversation.FRAMES, Frame, seen.picture)
        bus.subscribe("resource_pool/world", Conversation.BODIES, WorldState, world_moved, latest=True)
        yield bus, seen


def the_world() -> WorldDescription:
    [component] = [c for c in read_mission(MISSION_XML).components if c.type == "simulated_world"]
    return msgspec.convert(component.parameters["world"], WorldDescription)


def is_in_view(scout: RobotPlace, target: Target, world_s: float) -> bool:
    """Return whether any part of the target could be in the Scout's picture, without regard to furniture."""
    at = where(target, world_s)
    distance_m = math.hypot(at.x_m - scout.x_m, at.y_m - scout.y_m)
    direction_rad = math.atan2(at.y_m - scout.y_m, at.x_m - scout.x_m)
    off_axis_rad = abs(math.remainder(direction_rad - scout.heading_rad, math.tau))
    return off_axis_rad <= HORIZONTAL_VIEW_RAD / 2 + math.asin(min(1.0, math.sqrt(2) * PIONEER_RADIUS_M / distance_m))


def judge(seen: Seen, world: WorldDescription) -> None:
    """Each event shows a target that moves in view, or did in a picture not yet forgotten; no garbage was delivered."""
    scouts, [target] = {scout.name: scout for scout in world.robots}, world.targets
    for event in seen.events:
        steps = math.ceil((event.at_s - seen.remembers_since_s(event)) / STEP_S) + 1
        moments = [event.at_s - seen.world_began_s - step * STEP_S for step in range(steps)]
        assert any(
            is_in_view(scouts[event.robot], target, at_s)
            and math.dist(position(target, at_s), position(target, at_s - 0.1)) > STANDS_M
            for at_s in moments
        ), f"nothing moved in view of {event.robot} at {event}"
    assert seen.robots, "no picture was delivered"
    assert seen.robots <= set(scouts), "a picture of no robot, or of several"


def position(target: Target, at_s: float) -> tuple[float, float]:
    pose = where(target, at_s)
    return pose.x_m, pose.y_m


async def no_garbage(bus: Bus) -> None:
    world = (await bus.ask("resource_pool/world", AskStatistics(), Statistics, within_s=2)).values
    grabber = (await bus.ask("resource_pool/grabber", AskStatistics(), Statistics, within_s=2)).values
    assert world["jammed_frames"] == 0, world
    assert grabber["frames_garbled"] == 0, grabber


async def watch(mission: RunningMission, at_least_s: float) -> Seen:
    """Watch for so long, and until the first event."""
    async with observed(mission) as (bus, seen):
        async with asyncio.timeout(at_least_s + FIRST_EVENT_WITHIN_S):
            await asyncio.sleep(at_least_s)
            await seen.first.wait()
        await no_garbage(bus)
    return seen


@pytest.mark.thorough
async def test_the_target_is_seen_when_it_passes_and_only_then() -> None:
    with mission_up() as mission:
        seen = await watch(mission, SETTLED_S)
    print([(round(event.at_s, 2), event.robot) for event in seen.events])
    judge(seen, the_world())


@pytest.mark.thorough
async def test_nothing_is_seen_while_the_target_stands_in_the_doorway() -> None:
    """Swap-ins, also of a robot that a person has turned meanwhile, are no motion."""
    with mission_up(change={BEGIN: 'begin-s="1000"'}) as mission:
        async with observed(mission) as (bus, seen):
            await asyncio.sleep(6.0)
            before = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
            script = '{"at_s":0,"left_rad_s":4,"right_rad_s":-4}\n{"at_s":1,"release":true}\n'
            words = ("scout-console", "attach", "scout1", "--mission", mission.name, "--script", "-")
            done = await asyncio.to_thread(mission.command, *words, stdin=script)
            assert done.returncode == 0, done.stderr
            after = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
            assert abs(math.remainder(after.heading_rad - before.heading_rad, math.tau)) > 0.5
            await asyncio.sleep(7.0)
            await no_garbage(bus)
    assert seen.robots
    assert seen.robots == {"scout1", "scout2"}
    assert not seen.events


@pytest.mark.slow
async def test_a_whole_minute_of_the_mission(tmp_path: Path, judged: Callable[..., None]) -> None:
    """Both watchers in turns, both see the target, no picture is ever garbled."""
    trace = tmp_path / "run.jsonl"
    with mission_up("--for", "60", "--trace", str(trace)) as mission:
        async with observed(mission) as (_bus, seen):
            ended = await asyncio.to_thread(mission.launcher.wait, 90)
    assert ended == 0, mission.story()
    print([(round(event.at_s, 2), event.robot) for event in seen.events])
    assert seen.events, mission.story()
    judge(seen, the_world())
    judged(trace)
