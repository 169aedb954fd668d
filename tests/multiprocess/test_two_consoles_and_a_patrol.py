"""Two consoles of different priority take a patrolling robot over and give it back, at random."""

from __future__ import annotations

import asyncio
import random
import re
import statistics
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from consoles_at_work import WAIT_S, Console, consoles_at_work
from running_mission import MISSION_XML, RunningMission, mission_up

from backbone.bus.interface import Bus
from backbone.component.messages import AskStatistics, ComponentState, Parameters, SetParameter, Statistics
from backbone.keys import Conversation
from backbone.wire import Envelope
from mission_control.messages import WaypointReached
from resource_pool.arc_client import Suspended
from ui_console.model.driving import DriveWish

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

DRIVEN_WITHIN_S = 0.150
RESUMED_WITHIN_S = 0.300
A_WAY_S = 20.0
FOR_GOOD = 0.25  # share of the releases after which the next take-over starts a new process
PATROL, SCOUT, WORLD = "mission_control/patrol", "resource_pool/scout3", "resource_pool/world"
TREE = re.search(r'<behavior type="surveillance".*</behavior>', MISSION_XML.read_text(), re.DOTALL)
PATROLS = """<behavior type="patrol" name="patrol" priority="5">
      <arc kind="drive" minimum-runtime-s="1"><wish type="scout" name="scout3"/></arc>
      <parameter name="waypoints" value="4,1.4 4.4,1.4 4.4,1.8 4,1.8"/>
      <parameter name="localizer" value="world"/>
    </behavior>"""


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    assert TREE is not None
    with mission_up(change={TREE.group(): PATROLS}) as running:
        yield running


@dataclass
class Watch:
    """What is heard of the patrol: its way points, and what it says of itself, with the times it said so."""

    reached: list[WaypointReached] = field(default_factory=list)
    said: list[tuple[float, str]] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def listen(self, bus: Bus) -> None:
        bus.subscribe(PATROL, Conversation.EVENTS, WaypointReached, self._reached)
        bus.subscribe(PATROL, Conversation.STATUS, ComponentState, self._said)

    async def reaches(self, number: int) -> None:
        """Return when this many way points of the patrol were reached."""
        async with asyncio.timeout(number * A_WAY_S):
            while len(self.record()) < number:
                self.changed.clear()
                await self.changed.wait()

    def record(self) -> list[tuple[str, int, int]]:
        """Return robot, number and way point of each visit since the last patrol began."""
        visits = [(visit.robot, visit.number, visit.waypoint) for visit in self.reached]
        begins = [at for at, (_robot, number, _waypoint) in enumerate(visits) if number == 1]
        return visits[begins[-1] :] if begins else []

    def _reached(self, envelope: Envelope[Any]) -> None:
        self.reached.append(envelope.body)
        self.changed.set()

    def _said(self, envelope: Envelope[Any]) -> None:
        self.said.append((envelope.stamp_s, envelope.body.feedback))
        self.changed.set()

    async def says(self, begins: str, since_s: float) -> tuple[float, str]:
        """Return when, after a time, the patrol first said something that begins like this, and what."""
        async with asyncio.timeout(WAIT_S):
            while True:
                for at_s, feedback in self.said:
                    if at_s >= since_s and feedback.startswith(begins):
                        return at_s, feedback
                self.changed.clear()
                await self.changed.wait()


@asynccontextmanager
async def two_consoles(mission: RunningMission) -> AsyncIterator[tuple[Console, Console, Watch, Bus]]:
    watch = Watch()
    async with mission.bus("ui_console/onlooker") as bus:
        watch.listen(bus)
        people = [("console-low", 90), ("console-high", 100)]
        async with consoles_at_work(mission, bus, "scout3", people) as (low, high):
            yield low, high, watch, bus


async def counted(bus: Bus, address: str) -> dict[str, float]:
    return (await bus.ask(address, AskStatistics(), Statistics, within_s=2)).values


async def patrol_anew(bus: Bus, watch: Watch) -> None:
    """Have the patrol begin from its first way point, wherever the robot is."""
    watch.reached.clear()
    await bus.ask(PATROL, SetParameter("rounds", 0, "the test"), Parameters, within_s=2)


@dataclass
class Measured:
    """How long things took, seconds."""

    driven: list[float] = field(default_factory=list)
    resumed: list[float] = field(default_factory=list)

    def __str__(self) -> str:
        return f"driven {_summary(self.driven)}\nresumed {_summary(self.resumed)}"


def _summary(times_s: list[float]) -> str:
    ordered = sorted(times_s)
    late = ordered[max(0, round(0.99 * len(ordered)) - 1)]
    return (
        f"{len(ordered)} times: {statistics.median(ordered) * 1e3:.0f} ms (median), {late * 1e3:.0f} ms (99 %), "
        f"{ordered[-1] * 1e3:.0f} ms (most)"
    )


async def at_random(mission: RunningMission, cycles: int, seed: int) -> Measured:
    """Return how long control and resumption took; the rest of the rules is asserted here."""
    dice = random.Random(seed)
    took = Measured()
    async with two_consoles(mission) as (low, high, watch, bus):
        await watch.says("patrols", 0.0)
        await patrol_anew(bus, watch)
        before = await counted(bus, PATROL)
        for cycle in range(cycles):
            first = dice.choice([low, high])
            drive = DriveWish(dice.uniform(-6, 6), dice.uniform(-6, 6))
            asked_s = first.clock.now_s()
            took.driven.append(await first.take_and_drive(drive))
            _at_s, why = await watch.says("suspended", asked_s)
            assert f"higher by {first.name}-drive" in why, (cycle, why)
            await asyncio.sleep(dice.uniform(0.0, 0.2))
            if first is low and dice.random() < 0.5:
                mark = len(low.events)
                took.driven.append(await high.take_and_drive(drive))
                assert (await low.hears(mark, Suspended)).by == "console-high-drive"
                assert low.component is not None
                assert not await low.component.do(DriveWish(6, 6)), "commands of who lost the robot are refused"
                await high.give_back(for_good=dice.random() < FOR_GOOD)
            began_s = await first.give_back(for_good=dice.random() < FOR_GOOD)
            again_s, _said = await watch.says("patrols", began_s)
            took.resumed.append(again_s - began_s)
            await asyncio.sleep(dice.uniform(0.0, 0.3))
        await watch.reaches(1)
        disturbed = watch.record()
        after, world, scout = [await counted(bus, at) for at in (PATROL, WORLD, SCOUT)]
        await patrol_anew(bus, watch)
        await watch.reaches(len(disturbed))
        undisturbed = watch.record()
    stale = f"{world['stale_packets']:.0f} stale packets on the air, {scout['refused_stale']:.0f} refused before"
    print(f"{took}\n{len(disturbed)} way points; {stale}")
    assert world["stale_packets"] == 0
    assert after["times_suspended"] - before["times_suspended"] >= cycles
    assert disturbed == undisturbed[: len(disturbed)]
    return took


async def test_a_few_random_take_overs_by_two_consoles(mission: RunningMission) -> None:
    await at_random(mission, 8, seed=1)


@pytest.mark.slow
@pytest.mark.timeout(900)
async def test_two_hundred_random_take_overs_by_two_consoles(mission: RunningMission) -> None:
    took = await at_random(mission, 200, seed=2)
    assert (max(took.driven) < DRIVEN_WITHIN_S, max(took.resumed) < RESUMED_WITHIN_S) == (True, True), mission.story()
