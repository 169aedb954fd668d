"""The programs in bench/ still run. Each runs so briefly that its figures mean nothing."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.timeout(180)]

BENCH = Path(__file__).parents[2] / "bench"
PARTS = {"recovery_observer", "stops_gamepad", "world_loads"}
"""Run by other programs."""
JUDGES = {"stops", "unit_rates"}
"""Their exit codes judge the machine; ``stops`` has a test of its own."""
LONG = {"console", "idle", "recording", "recovery", "replay", "servoing", "trial", "web_console", "world"}
BRIEFLY = {
    "air": "--frames 20",
    "command_line": "--rounds 1",
    "command_path": "--seconds 1",
    "component_memory": "--components 2",
    "component_start": "--rounds 1",
    "debug_views": "--frames 20",
    "frames": "1 --frames 3",
    "mission_start": "--rounds 1",
    "motion_quality": "--crossings 1 --still 1",
    "placements": "--values 2",
    "round_trip": "--calls 20",
    "scale": "3 --seconds 1 --take-overs 1",
    "scheduler": "--arcs 10 --events 5",
    "switch_time": "--seconds 2",
    "vision": "--frames 20",
    "watching": "--rounds 1 --cycles 1",
}


def test_every_program_is_tried_or_left_out_for_a_reason() -> None:
    programs = {file.stem for file in BENCH.glob("*.py") if "__main__" in file.read_text()}
    assert programs == PARTS | JUDGES | LONG | BRIEFLY.keys()


@pytest.mark.parametrize(("name", "options"), BRIEFLY.items(), ids=BRIEFLY)
def test_a_program_prints_its_line(name: str, options: str) -> None:
    command = [sys.executable, str(BENCH / f"{name}.py"), *options.split()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=150, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["bench"] == name
