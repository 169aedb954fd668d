"""Three robots of different kinds, each taken over by two consoles and given back at random, all at the same time."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Iterator
from contextlib import AsyncExitStack
from pathlib import Path

import pytest
from consoles_at_work import consoles_at_work
from patrol_at_work import WORLD, Measured, TakeOvers, Watch, counted
from running_mission import RunningMission, mission_up

from ui_console.model.driving import MoveWish

pytest.importorskip("mink", reason="the walker's legs need the extra 'walker'")
pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

MISSION = Path(__file__).with_name("three-robots.xml")
KINDS = {"scout1": "drive", "rover1": "rover_drive", "walker1": "walker_drive"}


def stick(dice: random.Random) -> MoveWish:
    return MoveWish(dice.uniform(-0.2, 0.2), dice.uniform(-0.5, 0.5))


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    return tmp_path / "three.jsonl"


@pytest.fixture
def mission(trace: Path) -> Iterator[RunningMission]:
    with mission_up("--trace", str(trace), mission_xml=MISSION) as running:
        yield running


async def at_random(mission: RunningMission, cycles: int, seed: int) -> dict[str, Measured]:
    """Have ``cycles`` take-overs of each robot at once; return how long control and resumption took."""
    async with mission.bus("ui_console/onlooker") as bus, AsyncExitStack() as stack:
        all_of_them = []
        for number, (robot, kind) in enumerate(KINDS.items()):
            watch = Watch(f"mission_control/patrol-{robot}")
            watch.listen(bus)
            people = [(f"low-{robot}", 90), (f"high-{robot}", 100)]
            low, high = await stack.enter_async_context(consoles_at_work(mission, bus, robot, people, kind=kind))
            all_of_them.append(TakeOvers(low, high, watch, random.Random(100 * seed + number), stick))
        waypoints = await asyncio.gather(*(one.many(bus, cycles, visits=4) for one in all_of_them))
        world = await counted(bus, WORLD)
    took = {robot: one.took for robot, one in zip(KINDS, all_of_them, strict=True)}
    for (robot, times), visits in zip(took.items(), waypoints, strict=True):
        print(f"{robot}: {len(visits)} way points\n{times}")
    print(f"{world['stale_packets']:.0f} stale packets on the air")
    assert world["stale_packets"] == 0
    return took


@pytest.mark.thorough
async def test_a_few_take_overs_of_three_robots_at_once(
    mission: RunningMission, trace: Path, judged: Callable[[Path], None]
) -> None:
    await at_random(mission, 3, seed=1)
    assert mission.down() == 0
    judged(trace)


@pytest.mark.slow
@pytest.mark.timeout(1200)
async def test_two_hundred_take_overs_of_three_robots_at_once(
    mission: RunningMission, trace: Path, judged: Callable[[Path], None]
) -> None:
    took = await at_random(mission, 67, seed=2)
    assert mission.down() == 0
    judged(trace)
    assert [robot for robot, times in took.items() if not times.is_quick] == []
