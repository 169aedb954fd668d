"""The pure part needs no Linux: its tests pass on a platform that refuses everything that Linux alone has."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

TOP = Path(__file__).parents[2]
PURE = """
tests/backbone/scheduling/test_priority_order.py
tests/backbone/scheduling/test_schedule_manager.py
tests/backbone/scheduling/test_rcs_for_requests.py
tests/backbone/scheduling/test_answers_and_rules.py
tests/backbone/creator/test_supervision.py
tests/backbone/creator/test_supervision_laws.py
tests/backbone/creator/test_silence.py
tests/backbone/placer/test_placement.py
tests/backbone/placer/test_wishes.py
tests/backbone/nameserver/test_nameserver_registry.py
tests/backbone/picture
tests/backbone/test_wire.py
tests/backbone/test_errors.py
tests/backbone/test_naming.py
tests/backbone/bus/test_local_bus.py
tests/mission_control/modules/test_graph.py
tests/mission_control/modules/test_module.py
tests/mission_control/modules/test_execution_unit.py
tests/mission_control/modules/test_module_under_test.py
tests/mission_control/modules/test_unit_component.py
tests/ui_console/model
"""
"""Chosen: decisions of each package, a few of them with the local bus and the virtual clock."""


def on_another_platform(*words: str) -> subprocess.CompletedProcess[str]:
    """Return what pytest says of these tests."""
    plugins = ("-p", "no:scout_backbone", "-p", "other_platform", "-p", "mission_control.laboratory.module_kit.plugin")
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", *plugins, "-m", "not processes", *words],
        cwd=TOP,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.thorough
def test_the_pure_part_passes() -> None:
    done = on_another_platform(*PURE.split())
    assert done.returncode == 0, done.stdout


def test_what_needs_linux_is_refused_there() -> None:
    done = on_another_platform("tests/backbone/test_atomic_file.py")
    assert "NotOnThisPlatform: backbone.operating_system.file_locks.lock_alone_nowait" in done.stdout
