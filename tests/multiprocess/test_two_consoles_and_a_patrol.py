"""Two consoles of different priority take a patrolling robot over and give it back, at random."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator

import pytest
from consoles_at_work import consoles_at_work
from patrol_at_work import WORLD, Measured, TakeOvers, Watch, counted
from running_mission import MISSION_XML, RunningMission, mission_up

from ui_console.model.driving import DriveWish

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

PATROL, SCOUT = "mission_control/patrol", "resource_pool/scout3"
PEOPLE = [("console-low", 90), ("console-high", 100)]
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


def wheels(dice: random.Random) -> DriveWish:
    return DriveWish(dice.uniform(-6, 6), dice.uniform(-6, 6))


async def at_random(mission: RunningMission, cycles: int, seed: int) -> Measured:
    """Return how long control and resumption took; the rest of the rules is asserted here."""
    watch = Watch(PATROL)
    async with mission.bus("ui_console/onlooker") as bus:
        watch.listen(bus)
        async with consoles_at_work(mission, bus, "scout3", PEOPLE) as (low, high):
            take_overs = TakeOvers(low, high, watch, random.Random(seed), wheels)
            waypoints = await take_overs.many(bus, cycles)
        world, scout = [await counted(bus, at) for at in (WORLD, SCOUT)]
    stale = f"{world['stale_packets']:.0f} stale packets on the air, {scout['refused_stale']:.0f} refused before"
    print(f"{take_overs.took}\n{len(waypoints)} way points; {stale}")
    assert world["stale_packets"] == 0
    return take_overs.took


@pytest.mark.thorough
async def test_a_few_random_take_overs_by_two_consoles(mission: RunningMission) -> None:
    await at_random(mission, 8, seed=1)


@pytest.mark.slow
@pytest.mark.timeout(900)
async def test_two_hundred_random_take_overs_by_two_consoles(mission: RunningMission) -> None:
    took = await at_random(mission, 200, seed=2)
    assert took.is_quick, mission.story()
