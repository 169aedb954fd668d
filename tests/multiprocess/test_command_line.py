"""The command line as scripts use it: exit codes, data on stdout, talk on stderr."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from examples import rest_thorough
from running_mission import MARK, MISSION_XML, marked, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

BIN = Path(sys.executable).parent
BROKEN = Path(__file__).parents[1] / "backbone" / "mission" / "broken"
SMALLEST = MISSION_XML.parent / "docs" / "examples" / "smallest.xml"


def command(*words: str, folder: Path, mark: str = "cli") -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), MARK: mark}
    return subprocess.run(
        [str(BIN / words[0]), *words[1:]], env=environment, capture_output=True, text=True, timeout=90, check=False
    )


def test_a_good_mission_file_is_fine(tmp_path: Path) -> None:
    done = command("scout-backbone", "check", str(MISSION_XML), folder=tmp_path)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("level", ["1", "2"])
def test_an_interpreter_that_drops_assertions_and_docstrings_reads_mission_files(
    level: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONOPTIMIZE", level)
    monkeypatch.setenv("PYTHONPYCACHEPREFIX", str(tmp_path))
    done = command("scout-backbone", "check", str(MISSION_XML), folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


BRINGS_UP = [("up", "--headless", "--detach"), ("up",), ("check",)]


@pytest.mark.parametrize("words", rest_thorough((words,) for words in BRINGS_UP))
def test_a_broken_mission_file_is_refused_and_nothing_is_started(words: tuple[str, ...], tmp_path: Path) -> None:
    file = sorted(BROKEN.glob("*.xml"))[0]
    done = command("scout-backbone", *words, str(file), folder=tmp_path, mark=str(tmp_path))
    assert done.returncode == 3, done.stderr
    assert f"{file}:" in done.stdout
    assert not marked(str(tmp_path))
    assert not list(tmp_path.iterdir())


WITHOUT_A_MISSION = [
    "scout-backbone status",
    "scout-backbone down",
    "scout-console attach scout1 --script -",
    "scout-backbone components",
    "scout-backbone resources",
    "scout-backbone why scout1",
    "scout-backbone story scout1",
    "scout-backbone start scout",
    "scout-backbone stop scout1",
]


@pytest.mark.parametrize("words", rest_thorough(WITHOUT_A_MISSION))
def test_without_a_mission_a_command_says_so_and_exits_with_4(words: str, tmp_path: Path) -> None:
    done = command(*words.split(), folder=tmp_path)
    assert done.returncode == 4, done.stdout + done.stderr
    assert "no mission is up" in done.stdout + done.stderr


WRONG = [("up", str(MISSION_XML), "--speed", "0"), ("up",), ("nothing",)]


@pytest.mark.parametrize("words", rest_thorough((words,) for words in WRONG))
def test_wrong_usage_exits_with_2(words: tuple[str, ...], tmp_path: Path) -> None:
    assert command("scout-backbone", *words, folder=tmp_path).returncode == 2


def test_a_detached_mission_goes_on_until_it_is_told_to_end(tmp_path: Path) -> None:
    mark = f"detached-{os.getpid()}"
    up = command("scout-backbone", "up", str(SMALLEST), "--detach", folder=tmp_path, mark=mark)
    try:
        assert up.returncode == 0, up.stderr
        status = command("scout-backbone", "status", "--json", folder=tmp_path)
        assert json.loads(status.stdout)["mission"] == "smallest"
    finally:
        down = command("scout-backbone", "down", folder=tmp_path)
    assert down.returncode == 0, down.stderr
    assert "asking was enough" in down.stderr
    assert not marked(mark)
    assert not list((tmp_path / "scout-backbone").iterdir())


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_twenty_starts_in_a_row_show_the_papers_order(tmp_path: Path) -> None:
    order = ["nameserver", "component_database", "placer", "creator-base", "dependency_database", "rc_manager"]
    for _ in range(20):
        with mission_up("--for", "0") as running:
            assert running.launcher.wait(30) == 0, running.story()
        steps = [line.split()[1] for line in running.lines if "✓" in line]
        assert steps[: len(order)] == order
