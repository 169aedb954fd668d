"""The example mission of two kinds of robot: it is sound, and one behavior drives both at the same time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from behaviors_at_work import EXAMPLES, at_work, hear, pose, wait_until
from errands import errand

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from mission_control.messages import WaypointReached

MIXED = EXAMPLES / "mixed.xml"


def test_one_behavior_patrols_with_a_rover_and_with_a_scout_on_one_radio() -> None:
    async def main() -> None:
        async with at_work(read_mission(MIXED)) as running:
            visits = {robot: hear(running, f"patrol-{robot}", WaypointReached) for robot in ("rover1", "scout1")}
            for number, place in enumerate([(3, 2), (6, 2), (6, 4.5), (3, 4.5)], start=1):
                await wait_until(running, lambda n=number: len(visits["rover1"]) >= n, 40.0)
                at = await pose(running, "rover1")
                assert (at.x_m, at.y_m) == pytest.approx(place, abs=0.2)
            for robot, heard in visits.items():
                assert [(visit.robot, visit.waypoint) for visit in heard[:4]] == [(robot, place) for place in range(4)]
            world = await running.statistics("world")
            assert world["packets_for_no_robot"] == world["stale_packets"] == 0

    run_virtual(main())


def test_a_rover_goes_out_and_home_by_dead_reckoning() -> None:
    run_virtual(errand(MIXED, "rover1", "rover", (6.0, 4.0)))


@pytest.mark.processes
def test_the_example_is_sound_and_no_robot_waits_for_the_other() -> None:
    command = [str(Path(sys.executable).parent / "scout-backbone"), "check", "docs/examples/mixed.xml", "--dry-run"]
    done = subprocess.run(command, cwd=MIXED.parents[2], capture_output=True, text=True, check=False)
    assert (done.returncode, "every request gets its turn" in done.stdout) == (0, True), done.stdout + done.stderr
