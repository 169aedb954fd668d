"""Every fault planted in the scheduling core is caught by the default tests beside this one."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from planted_faults import FAULTS, ROOM, Planted

TOP = Path(__file__).parents[3]
TREES = ("backbone", "tests/backbone/scheduling", "tests/trace_checker")
FILES = ("pyproject.toml", "tests/conftest.py", "tests/trace_judge.py")
FOUND = 1  # pytest's exit code when a test failed


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_planted_fault_has_its_place(fault: Planted) -> None:
    assert (TOP / ROOM / fault.file).read_text().count(fault.right) == 1


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_planted_fault_is_caught(fault: Planted, tmp_path: Path) -> None:
    for tree in TREES:
        shutil.copytree(TOP / tree, tmp_path / tree, ignore=shutil.ignore_patterns("__pycache__", "test_planted*"))
    for file in FILES:
        if (TOP / file).exists():
            shutil.copy(TOP / file, tmp_path / file)
    planted = tmp_path / ROOM / fault.file
    planted.write_text(planted.read_text().replace(fault.right, fault.wrong))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "tests/backbone/scheduling"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == FOUND, done.stdout[-2000:]
