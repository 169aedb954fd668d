"""The guide that adds a robot, executed: its files make a robot that patrols and obeys a command of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from guide import files_of, lines_of, pool_of, rehearse, written
from pool_on_local_network import a_pool
from world_joints import joints

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from mission_control.behaviors.patrol import Patrol
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process

FILES = files_of("add-a-robot.md")
RC_LINES, ARC_LINES = 40, 25  # chosen: more is not done in an hour


@pytest.fixture
def mission(tmp_path: Path) -> Iterator[Path]:
    """Give the guide's mission file; its robot can be imported."""
    with written(FILES, tmp_path, "my_robots"):
        yield tmp_path / "cart.xml"


def test_the_robot_of_the_guide_patrols(mission: Path) -> None:
    async def main() -> None:
        async with mission_in_one_process(read_mission(mission)) as running:
            behavior = running.component("patrol")
            assert isinstance(behavior, Patrol)
            until_s = running.clock.now_s() + 60.0
            while behavior.route.reached < 4:
                assert running.clock.now_s() < until_s, f"{behavior.route.reached} way points in a minute"
                await running.clock.sleep_s(1.0)
            assert (await running.statistics("world"))["stale_packets"] == 0

    run_virtual(main())


def test_it_obeys_its_own_command_while_it_drives_and_keeps_to_its_limits(mission: Path, local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["radio", "cart1"], **pool_of(read_mission(mission), "my_robots")) as pool:
            arc = await pool.arc(await pool.owner("walker"), "cart_drive", "cart1")
            await arc.wait_granted()
            began_m, _ = await pool.pose("cart1")
            assert (await arc.move(9.0)).values == {"forward_m_s": 0.5, "turn_rad_s": 0.0}
            assert (await arc.give("raise", {"height_m": 9.0})).values == {"height_m": 0.2}
            for _ in range(10):
                await arc.move(0.3)
                await pool.clock.sleep_s(0.1)
            there_m, _ = await pool.pose("cart1")
            assert there_m - began_m > 0.2
            assert await joints(pool, "cart1/mast") == [pytest.approx(0.2, abs=0.01)]
            await pool.clock.sleep_s(1.0)
            stood_m = await pool.pose("cart1")
            await pool.clock.sleep_s(1.0)
            assert await pool.pose("cart1") == pytest.approx(stood_m, abs=1e-3)

    run_virtual(main())


def test_rc_and_arcs_of_the_guide_are_short() -> None:
    assert sorted(FILES) == ["cart.xml", *(f"my_robots/{name}" for name in ("arcs.py", "cart.py", "cart.xml", "rc.py"))]
    assert lines_of(FILES["my_robots/rc.py"]) <= RC_LINES
    assert lines_of(FILES["my_robots/arcs.py"]) <= ARC_LINES


@pytest.mark.processes
def test_the_mission_file_of_the_guide_is_sound(mission: Path) -> None:
    done = rehearse(mission)
    assert (done.returncode, "every request gets its turn" in done.stdout) == (0, True), done.stdout + done.stderr
