"""A Scout goes out and home by dead reckoning, in processes of their own; the simulated world tells the truth."""

from __future__ import annotations

import asyncio
import math
import os
import signal
import time
from pathlib import Path

import pytest
from running_mission import RunningMission, mission_up, status_when_settled

from backbone.bus.interface import Bus
from backbone.keys import Conversation
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus
from resource_pool.localization import AskPose, Pose, PoseSource

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

GO_TO = Path(__file__).parents[2] / "docs" / "examples" / "go-to.xml"
GOAL, HOME = (3.0, 2.0), (1.0, 1.0)
THERE_WITHIN_S = 90.0


async def truth(bus: Bus) -> Pose:
    return await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)


def away_m(at: Pose, place: tuple[float, float]) -> float:
    return math.hypot(at.x_m - place[0], at.y_m - place[1])


async def goes_out(bus: Bus, mission: RunningMission, ends_s: float) -> float:
    """Wait until the errand is at its place; return how near to it the Scout was meanwhile."""
    nearest_m = math.inf
    while True:
        nearest_m = min(nearest_m, away_m(await truth(bus), GOAL))
        errand = await bus.ask("mission_control/errand", AskBehavior(), BehaviorState, within_s=2)
        if "go-out (go_to, priority 3): success" in errand.tree:
            return nearest_m
        assert not errand.status.is_final, f"{errand}\n{mission.story()}"
        assert time.monotonic() < ends_s, f"{errand}\n{mission.story()}"
        await asyncio.sleep(0.2)


@pytest.mark.thorough
async def test_a_scout_goes_to_its_place_and_home_by_dead_reckoning() -> None:
    with mission_up(mission_xml=GO_TO) as mission:
        async with mission.bus() as bus:
            published: list[Pose] = []
            bus.subscribe(
                "resource_pool/localizer", Conversation.POSES, Pose, lambda heard: published.append(heard.body)
            )
            nearest_m, ends_s = math.inf, time.monotonic() + THERE_WITHIN_S
            while True:
                nearest_m = min(nearest_m, away_m(await truth(bus), GOAL))
                errand = await bus.ask("mission_control/errand", AskBehavior(), BehaviorState, within_s=2)
                if errand.status.is_final:
                    break
                assert time.monotonic() < ends_s, f"{errand}\n{mission.story()}"
                await asyncio.sleep(0.2)
            assert errand.status is BehaviorStatus.SUCCESS, f"{errand}\n{mission.story()}"
            at = await truth(bus)
            believed = await bus.ask("resource_pool/localizer", AskPose("scout1"), Pose, within_s=2)
        assert nearest_m < 0.4  # measured: 0.11 m, on virtual time 0.15 m
        assert away_m(at, HOME) < 0.6  # measured: 0.08 m, on virtual time 0.21 m
        assert away_m(at, (believed.x_m, believed.y_m)) <= 2 * believed.spread_m
        assert {pose.body for pose in published} == {"scout1", "scout2"}
        assert {pose.source for pose in published} == {PoseSource.DEAD_RECKONING}


@pytest.mark.thorough
@pytest.mark.parametrize("shared", [False, True])
async def test_a_localizer_that_is_killed_on_the_way_misses_no_motion_and_the_scout_gets_there(
    tmp_path: Path, *, shared: bool
) -> None:
    """It is killed while the Scout turns towards its place, alone or together with the robots' RCs.

    A second localizer, which lives on, is the measure.
    """
    two = tmp_path / "two.xml"
    first = '<resource type="localizer" name="localizer" process="hardware"/>'
    text = GO_TO.read_text(encoding="utf-8")
    assert first in text
    killed_one = first if shared else first.replace(' process="hardware"', "")
    second_one = '<resource type="localizer" name="second"/>'
    two.write_text(text.replace(first, killed_one + second_one), encoding="utf-8")
    with mission_up(mission_xml=two) as mission:
        async with mission.bus() as bus:
            ends_s = time.monotonic() + THERE_WITHIN_S
            while (await truth(bus)).heading_rad > math.pi / 2 - 0.2:
                assert time.monotonic() < ends_s, mission.story()
                await asyncio.sleep(0.02)
            os.kill(mission.component("localizer")["pid"], signal.SIGKILL)
            nearest_m = await goes_out(bus, mission, ends_s)
            killed, second = [
                await bus.ask(f"resource_pool/{one}", AskPose("scout1"), Pose, within_s=2)
                for one in ("localizer", "second")
            ]
        assert mission.component("localizer")["restarts"] == 1
        assert away_m(killed, (second.x_m, second.y_m)) < 0.02, (killed, second)
        assert math.cos(killed.heading_rad - second.heading_rad) > math.cos(0.02), (killed, second)
        assert nearest_m < 0.4  # as of a localizer that lives


@pytest.mark.thorough
async def test_a_world_that_is_killed_leaves_the_robots_where_they_were() -> None:
    with mission_up(mission_xml=GO_TO) as mission:
        async with mission.bus() as bus:
            ends_s = time.monotonic() + THERE_WITHIN_S
            while away_m(before := await truth(bus), HOME) < 0.5:
                assert time.monotonic() < ends_s, mission.story()
                await asyncio.sleep(0.1)
            os.kill(mission.component("world")["pid"], signal.SIGKILL)
            await asyncio.to_thread(mission.wait_for_line, "world: fell", 10)
            await asyncio.to_thread(status_when_settled, mission)
            after = await truth(bus)
            assert away_m(after, (before.x_m, before.y_m)) < 0.3, (before, after)  # it drove on for a moment
            nearest_m = await goes_out(bus, mission, ends_s)
        assert mission.component("world")["restarts"] == 1
        assert nearest_m < 0.4
