"""The module kit as its users have it: the guide's tests, an example outside of the tree, and what it costs unused."""

from __future__ import annotations

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from mission_control.laboratory.module_kit.real_mission import BringUp

pytestmark = [pytest.mark.processes, pytest.mark.timeout(900)]

TOP = Path(__file__).parents[2]
EXAMPLES = TOP / "docs" / "examples"
GUIDE = TOP / "docs" / "how-to" / "test-a-module.md"
INSTALLED_WITHIN_S = 800.0  # chosen: a network that is slow, on a busy machine


def done(*words: str, folder: Path, **environment: str) -> str:
    """Return what the command prints; fail with it if the command fails."""
    ended = subprocess.run(
        words,
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=INSTALLED_WITHIN_S,
        check=False,
    )
    assert ended.returncode == 0, f"{words}\n{ended.stdout}"
    return ended.stdout


def test_a_plugin_that_is_not_used_imports_nothing_but_itself() -> None:
    plugin = "mission_control.laboratory.module_kit.plugin"
    code = f"import sys, pytest; old = set(sys.modules); import {plugin}; print(*sorted(set(sys.modules) - old))"
    parts = plugin.split(".")
    assert done(sys.executable, "-c", code, folder=TOP).split() == [".".join(parts[:end]) for end in range(1, 5)]


def test_pytest_comes_with_an_extra_only() -> None:
    needs = [one for one in importlib.metadata.requires("scout-backbone") or () if one.startswith("pytest")]
    assert needs
    assert all("extra ==" in one for one in needs)


def test_a_test_that_fails_says_what_the_mission_said_and_leaves_nothing(real_mission: BringUp) -> None:
    processes: list[psutil.Process] = []

    def fails() -> None:
        with real_mission(EXAMPLES / "smallest.xml") as running:
            processes.extend(running.processes())
            raise LookupError

    with pytest.raises(LookupError) as failed:
        fails()
    assert len(processes) > 3
    [note] = failed.value.__notes__
    assert "--- up said" in note
    assert "all ready" in note
    assert "--- rc_manager.log" in note
    assert psutil.wait_procs(processes, timeout=10)[1] == []


def test_a_command_that_is_not_over_in_time_says_what_the_mission_said(real_mission: BringUp) -> None:
    with (
        real_mission(EXAMPLES / "smallest.xml") as running,
        pytest.raises(AssertionError, match=r"timed out after 0\.5 seconds(.|\n)*--- up said(.|\n)*all ready"),
    ):
        running.command("scout-console", "monitor", "--json", "--mission", running.name, within_s=0.5)


def test_a_mission_that_is_refused_says_why(real_mission: BringUp) -> None:
    with pytest.raises(AssertionError, match="no line '\\^all ready'") as failed, real_mission("<mission/>"):
        pass
    assert "priority" in failed.value.__notes__[0]


@pytest.mark.thorough
def test_the_guides_tests_pass(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "pair.py", tmp_path)
    shutil.copy(EXAMPLES / "pair.xml", tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    (tmp_path / "test_guide.py").write_text("\n\n".join(blocks))
    told = done(sys.executable, "-m", "pytest", "-q", folder=tmp_path, PYTHONPATH=str(tmp_path))
    assert "6 passed" in told


@pytest.mark.thorough
def test_an_example_outside_of_the_tree_is_installed_and_tested_by_the_commands_of_its_readme(tmp_path: Path) -> None:
    example = tmp_path / "red-ball"
    shutil.copytree(EXAMPLES / "red-ball", example, ignore=shutil.ignore_patterns(".*", "__pycache__"))
    [commands] = re.findall(r"```bash\n(.*?)```", (example / "README.md").read_text(), re.DOTALL)
    assert len(commands.splitlines()) == 2
    assert (EXAMPLES / "red-ball" / "../../..").resolve() == TOP
    commands = commands.replace("../../..", str(TOP))  # as the README asks of a copy
    told = done("bash", "-euo", "pipefail", "-c", commands, folder=example, PYTHONPATH="")
    assert "6 passed" in told
