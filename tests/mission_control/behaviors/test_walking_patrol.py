"""The example mission of a walker and a Scout: it is sound, and the behavior that drives one walks with the other."""

from __future__ import annotations

import pytest
from behaviors_at_work import EXAMPLES, at_work, hear, pose, wait_until
from errands import errand
from rehearsed_missions import assert_each_gets_its_turn

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from mission_control.messages import WaypointReached

WALKER = EXAMPLES / "walker.xml"
PLACES = [(2, 2), (4, 2), (4, 3.5), (2, 3.5)]


def patrols(rounds: int) -> None:
    """Let walker and Scout patrol; fail unless the walker goes round, is never stuck, and the radio is never late."""

    async def main() -> None:
        async with at_work(read_mission(WALKER)) as running:
            visits = {robot: hear(running, f"patrol-{robot}", WaypointReached) for robot in ("walker1", "scout1")}
            for number in range(1, rounds * len(PLACES) + 1):
                await wait_until(running, lambda n=number: len(visits["walker1"]) >= n, 40.0)
                at = await pose(running, "walker1")
                assert (at.x_m, at.y_m) == pytest.approx(PLACES[(number - 1) % len(PLACES)], abs=0.2)
            assert [visit.waypoint for visit in visits["scout1"][:4]] == [0, 1, 0, 1]
            assert (await running.statistics("patrol-walker1"))["shaken_free"] == 0
            radio, world = await running.statistics("radio"), await running.statistics("world")
            assert not any(late for name, late in radio.items() if "overruns" in name)
            assert radio["worst_packet_s"] < 0.006
            assert world["packets_for_no_robot"] == world["stale_packets"] == 0

    run_virtual(main())


@pytest.mark.thorough
def test_one_behavior_patrols_with_a_walker_and_with_a_scout_on_one_radio() -> None:
    patrols(1)


@pytest.mark.thorough
def test_the_walker_goes_out_and_home_by_dead_reckoning() -> None:
    run_virtual(errand(WALKER, "walker1", "walker", (4.0, 3.0)))


@pytest.mark.slow
def test_the_walker_patrols_ten_rounds() -> None:
    patrols(10)


def test_the_example_is_sound_and_no_robot_waits_for_the_other() -> None:
    assert_each_gets_its_turn(WALKER)
