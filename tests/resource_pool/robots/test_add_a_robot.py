"""The guide that adds a robot, executed: its files make a robot that patrols and obeys a command of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from pool_on_local_network import a_pool
from world_joints import joints

from backbone.bus.clock import run_virtual
from backbone.component.process import load_class
from backbone.mission.reader import read_mission
from mission_control.behaviors.patrol import Patrol
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process
from scout_model.description import WorldDescription

TOP = Path(__file__).parents[3]
GUIDE = (TOP / "docs" / "how-to" / "add-a-robot.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^`([\w./]+)`:\n\n```\w+\n(.*?)^```", GUIDE, re.M | re.S))
RC_LINES, ARC_LINES = 40, 25  # chosen: more is not done in an hour


@pytest.fixture
def mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Give the guide's mission file; its robots can be imported."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "my_robots" / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path / "cart.xml"
    for module in [name for name in sys.modules if name.partition(".")[0] == "my_robots"]:
        del sys.modules[module]


def lines_of(name: str) -> int:
    return len([line for line in FILES[name].splitlines() if line.strip()])


def test_the_robot_of_the_guide_patrols(mission: Path) -> None:
    async def main() -> None:
        async with mission_in_one_process(read_mission(mission)) as running:
            behavior = running.component("patrol")
            assert isinstance(behavior, Patrol)
            for _ in range(60):
                await running.clock.sleep_s(1.0)
                if behavior.route.reached >= 4:
                    break
            assert behavior.route.reached >= 4
            assert (await running.statistics("world"))["stale_packets"] == 0

    run_virtual(main())


def test_it_obeys_its_own_command_while_it_drives_and_keeps_to_its_limits(mission: Path, local_mission: Any) -> None:
    described = read_mission(mission)
    classes = {kind.name: load_class(kind.class_path) for kind in described.types if "my_robots" in kind.class_path}
    [world] = [component for component in described.components if component.name == "world"]

    async def main() -> None:
        async with a_pool(
            local_mission,
            ["radio", "cart1"],
            world=msgspec.convert(world.parameters["world"], WorldDescription),
            hardware=[resource for resource in described.resources if resource.name != "radio"],
            rc_classes={"cart": classes["cart"]},
            arc_classes={"cart_drive": classes["cart_drive"]},  # type: ignore[dict-item]
        ) as pool:
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


def test_rc_and_arcs_of_the_guide_are_as_short_as_it_says() -> None:
    assert sorted(FILES) == ["cart.xml", *(f"my_robots/{name}" for name in ("arcs.py", "cart.py", "cart.xml", "rc.py"))]
    assert lines_of("my_robots/rc.py") <= RC_LINES
    assert lines_of("my_robots/arcs.py") <= ARC_LINES


@pytest.mark.processes
def test_the_mission_file_of_the_guide_is_sound(mission: Path) -> None:
    command = [str(Path(sys.executable).parent / "scout-backbone"), "check", "cart.xml", "--dry-run"]
    paths = os.pathsep.join([str(mission.parent), str(TOP)])
    done = subprocess.run(
        command,
        cwd=mission.parent,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, "every request gets its turn" in done.stdout) == (0, True), done.stdout + done.stderr
