"""The command line refuses early and says what to do."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ui_console.cli import app


@pytest.fixture(autouse=True)
def _no_mission_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def test_without_a_mission_it_cannot_reach_the_backbone(tmp_path: Path) -> None:
    script = tmp_path / "drive.jsonl"
    script.write_text('{"at_s":0,"release":true}')
    done = CliRunner().invoke(app, ["attach", "scout1", "--script", str(script)])
    assert done.exit_code == 4
    assert "scout-backbone up" in done.stderr
    assert done.stdout == ""


def test_a_wrong_script_is_refused_with_its_line_before_a_mission_is_looked_for(tmp_path: Path) -> None:
    script = tmp_path / "drive.jsonl"
    script.write_text('{"at_s":0,"halt":true}\n{"at_s":1,"dance":true}\n')
    done = CliRunner().invoke(app, ["attach", "scout1", "--script", str(script)])
    assert done.exit_code == 2
    assert "line 2" in done.stderr


def test_an_empty_name_takes_no_robot_at_random() -> None:
    done = CliRunner().invoke(app, ["attach", "", "--json"])
    assert done.exit_code == 2
    assert "the name is empty" in done.stderr


def test_a_missing_script_is_named(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["attach", "--script", str(tmp_path / "none.jsonl")])
    assert done.exit_code == 2
    assert "none.jsonl" in done.stderr


@pytest.mark.parametrize("arguments", [["attach", "scout1"], ["monitor"]])
def test_without_a_terminal_it_says_what_to_use_instead(arguments: list[str]) -> None:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert "--json" in done.stderr


@pytest.mark.parametrize("words", [["--json"], ["--once"], ["--mission", "iros2001"], []])
def test_a_recording_is_watched_at_a_terminal_and_no_mission_with_it(words: list[str]) -> None:
    done = CliRunner().invoke(app, ["monitor", "--recording", "night.mcap", *words])
    assert done.exit_code == 2
    assert ("needs a terminal" if not words else "missions that are up") in done.stderr


def test_another_machines_mission_must_be_named() -> None:
    done = CliRunner().invoke(app, ["monitor", "--json", "--connect", "tcp/127.0.0.1:1"])
    assert done.exit_code == 2


@pytest.mark.parametrize("name", ["x" * 256, "a\nb", os.fsdecode(b"\xff"), " ", "anna "])
@pytest.mark.parametrize("command", ["attach", "monitor"])
def test_a_persons_name_that_no_message_can_contain_or_no_text_can_show_is_wrong_usage(command: str, name: str) -> None:
    done = CliRunner().invoke(app, [command, "--json", "--user", name])
    assert done.exit_code == 2
    assert "255 printable characters" in done.stderr


@pytest.mark.processes
def test_help_loads_no_screen_and_no_bus() -> None:
    check = (
        "import sys, ui_console.cli;"
        "sys.exit(', '.join({'textual', 'zenoh', 'numpy', 'cv2', 'mujoco', 'pydantic'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
