"""Every fault planted in the scheduling core is caught by the default tests beside this one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from planted_faults import FAULTS, ROOM, Planted

TOP = Path(__file__).parents[3]
LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "pictures", "test_planted_faults.py")
FOUND = 1  # pytest's exit code when a test failed
MOST_S = 250.0  # chosen: three times what the tests of the room need when none fails
MOST_BUSY_S = 500.0  # chosen: what is right may take long on a busy machine


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_planted_fault_has_its_place(fault: Planted) -> None:
    assert (TOP / ROOM / fault.file).read_text().count(fault.right) == 1


@pytest.mark.processes
@pytest.mark.slow
@pytest.mark.timeout(600)
def test_what_is_not_planted_is_not_caught(tmp_path: Path) -> None:
    done = outcome_of(copied(tmp_path), MOST_BUSY_S)
    assert done.returncode == 0, done.stdout[-2000:]


@pytest.mark.processes
@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_planted_fault_is_caught(fault: Planted, tmp_path: Path) -> None:
    copy = copied(tmp_path)
    planted = copy / ROOM / fault.file
    planted.write_text(planted.read_text().replace(fault.right, fault.wrong))
    done = outcome_of(copy, MOST_S)
    assert done.returncode == FOUND, done.stdout[-2000:]


def copied(to: Path) -> Path:
    """Return a copy of the project."""
    return shutil.copytree(TOP, to / "copy", ignore=LEFT_OUT)


def outcome_of(folder: Path, within_s: float) -> subprocess.CompletedProcess[str]:
    """Run the tests of the room in this copy, all examples of each law, until one fails."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "tests/backbone/scheduling"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "SCOUT_EXAMPLES": "full"},
        timeout=within_s,
    )
