"""Help and completion load neither bus nor simulation nor screen: a person waits for them with a finger on the key."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import pytest
from examples import rest_thorough

from backbone import run_files, run_names

pytestmark = pytest.mark.processes

HEAVY = {"asyncio", "cv2", "lxml", "msgspec", "mujoco", "numpy", "pydantic", "rich", "textual", "uvloop", "zenoh"}
PROGRAMS = {"scout-backbone": "backbone.command_line.cli", "scout-console": "ui_console.cli"}
RUN = """
import contextlib, importlib, sys
program, module, *words = sys.argv[1:]
sys.argv = [program, *words]
with contextlib.suppress(SystemExit):
    importlib.import_module(module).main()
sys.stdout.flush()
print(*sorted(sys.modules), file=sys.stderr)
"""


def run(program: str, *words: str, folder: Path, variables: Mapping[str, str] | None = None) -> tuple[str, set[str]]:
    """Return what the program prints, and which of the heavy modules it has loaded."""
    done = subprocess.run(
        [sys.executable, "-c", RUN, program, PROGRAMS[program], *words],
        env={**os.environ, "XDG_RUNTIME_DIR": str(folder), **(variables or {})},
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout, HEAVY & set(done.stderr.splitlines()[-1].split())


def completing(*typed: str) -> dict[str, str]:
    """Return what bash sets to ask for completions of the last word."""
    name = f"_{typed[0].replace('-', '_').upper()}_COMPLETE"
    return {name: "complete_bash", "COMP_WORDS": " ".join(typed), "COMP_CWORD": str(len(typed) - 1)}


@pytest.mark.parametrize("program", PROGRAMS)
def test_help_loads_nothing_heavy(program: str, tmp_path: Path) -> None:
    printed, loaded = run(program, "--help", folder=tmp_path)
    assert f"Usage: {program}" in printed
    assert loaded == set()


def test_up_reads_the_mission_file_in_another_process(tmp_path: Path) -> None:
    printed, loaded = run("scout-backbone", "up", str(tmp_path / "missing.xml"), "--for", "1", folder=tmp_path)
    assert "missing.xml:1:1:" in printed
    assert not loaded & {"pydantic", "cv2", "mujoco", "numpy"}


@pytest.mark.parametrize("program", PROGRAMS)
def test_both_programs_print_the_version_that_is_installed(program: str, tmp_path: Path) -> None:
    printed, loaded = run(program, "--version", folder=tmp_path)
    assert printed == f"scout-backbone {version('scout-backbone')}\n"
    assert loaded == set()


@pytest.mark.parametrize(
    ("typed", "offered"),
    rest_thorough(
        [
            (("scout-backbone", "sta"), ["status", "start"]),
            (("scout-backbone", "why", ""), []),
            (("scout-backbone", "status", "--mission", ""), []),
            (("scout-console", "attach", "scout1", "--priority", "5", "--prof"), ["--profile"]),
            (("scout-backbone", "--ver"), ["--version"]),
            (("scout-backbone", "status", "--wa"), ["--watch"]),
            (("scout-backbone", "components", "--type", ""), []),
            (("scout-backbone", "resources", ""), []),
            (("scout-backbone", "start", ""), []),
            (("scout-backbone", "log", "--level", "war"), ["warning"]),
            (("scout-console", "mon"), ["monitor"]),
            (("scout-console", "attach", ""), []),
        ],
        quick=4,
    ),
    ids=str,
)
def test_completion_loads_nothing_heavy_where_no_mission_is_up(
    typed: tuple[str, ...], offered: list[str], tmp_path: Path
) -> None:
    printed, loaded = run(typed[0], folder=tmp_path, variables=completing(*typed))
    assert printed.split() == offered
    assert loaded == (set() if offered else {"msgspec"}), "names come from run files"


@pytest.mark.parametrize(
    ("typed", "offered"),
    rest_thorough(
        [
            (("scout-backbone", "why", ""), ["scout1", "watch1"]),
            (("scout-console", "look", ""), ["watch1"]),
            (("scout-backbone", "start", ""), ["patrol"]),
            (("scout-console", "attach", ""), ["scout1"]),
        ],
        quick=2,
    ),
    ids=str,
)
def test_names_of_a_mission_that_is_up_are_completed_without_asking_it(
    typed: tuple[str, ...], offered: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    up = run_files.RunFile("m", "tcp/127.0.0.1:1", os.getpid(), 0.0, 1.0, "base", "none")
    names = run_names.MissionNames(["scout1", "watch1"], ["scout1"], ["scout1"], ["watch1"], [], ["patrol"])
    run_names.write(run_files.write(up).parent, names)
    printed, loaded = run(typed[0], folder=tmp_path, variables=completing(*typed))
    assert printed.split() == offered
    assert loaded == {"msgspec"}


@pytest.mark.parametrize(
    "words",
    rest_thorough(
        [
            "status --json",
            "why scout1 --mission m",
            "status --mission m --connect tcp/127.0.0.1:1",
            "status",
            "status --mission m",
            "story scout1",
        ],
        quick=3,
    ),
)
def test_a_question_to_no_mission_loads_no_description_no_simulation_and_no_conversion_of_texts(
    words: str, tmp_path: Path
) -> None:
    _, loaded = run("scout-backbone", *words.split(), folder=tmp_path)
    assert loaded <= {"asyncio", "msgspec", "uvloop", "zenoh", *([] if "--json" in words else ["rich"])}
