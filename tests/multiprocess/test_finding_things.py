"""An operator finds out, by the command line alone: who moved a robot, why it waits, and how a name is spelled."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from running_mission import BIN, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

LONG_NUMBER = re.compile(r"\d\.\d{7}")
DRIVE = '{"at_s":0.1,"left_rad_s":3,"right_rad_s":3}\n{"at_s":0.5,"release":true}\n'


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        words = ("scout-console", "attach", "scout2", "--mission", running.name, "--user", "Anna B.", "--script", "-")
        done = running.command(*words, stdin=DRIVE)
        assert done.returncode == 0, done.stdout + done.stderr + running.story()
        yield running


def backbone(mission: RunningMission, *words: str) -> subprocess.CompletedProcess[str]:
    return mission.command("scout-backbone", *words, "--mission", mission.name)


def test_who_moved_a_robot_is_found_after_the_console_has_gone(mission: RunningMission) -> None:
    done = backbone(mission, "log", "--robot", "scout2", "--person", "anna b.", "--since", "10m", "--json")
    assert done.returncode == 0, done.stderr
    events = json.loads(done.stdout)["events"]
    assert [event["person"] for event in events if "is driven by" in event["what"]] == ["Anna B."]
    assert all(event["level"] in ("alarm", "warning", "notice", "info") for event in events)
    shown = backbone(mission, "log", "--text", "DRIVEN BY").stdout
    assert "scout2" in shown
    assert "Anna B." in shown


def test_a_story_is_one_object_and_calls_nobody_by_a_number(mission: RunningMission) -> None:
    done = backbone(mission, "story", "scout2", "--json")
    told = json.loads(done.stdout)
    assert told["name"] == "scout2"
    assert {"at_s", "level", "subject", "what", "person", "where", "cause"} == told["events"][0].keys()
    shown = backbone(mission, "story", "scout2").stdout
    assert "Anna B.: connected under epoch" in shown
    assert not re.search(r"console-\d+-drive", shown)


def test_why_knows_machines_alarms_and_events(mission: RunningMission) -> None:
    assert "base is a machine of the mission" in backbone(mission, "why", "base").stdout
    assert "scout1 is ready on base" in backbone(mission, "why", "rc_down:scout1").stdout
    causes = [event["cause"] for event in json.loads(backbone(mission, "story", "scout2", "--json").stdout)["events"]]
    cause = next(each for each in reversed(causes) if each.startswith("backbone/rc_manager#"))
    told = backbone(mission, "why", cause.removeprefix("backbone/")).stdout
    assert "this message led to:" in told


def test_a_robot_that_is_misspelled_is_one_sentence(mission: RunningMission) -> None:
    words = ("scout-console", "attach", "scuot1", "--mission", mission.name, "--script", "-")
    done = mission.command(*words, stdin=DRIVE)
    assert done.returncode == 5
    refused = json.loads(done.stdout.splitlines()[0])
    assert refused["detail"].startswith("no robot is named 'scuot1' (did you mean 'scout1'?)")
    assert "Traceback" not in done.stdout + done.stderr
    assert "\n" not in refused["detail"]


@pytest.mark.parametrize("words", [("status",), ("why", "scout2"), ("story", "scout2"), ("log",), ("set", "radio")])
def test_numbers_are_for_people(mission: RunningMission, words: tuple[str, ...]) -> None:
    done = backbone(mission, *words)
    assert done.returncode == 0, done.stderr
    assert not LONG_NUMBER.search(done.stdout), done.stdout


def completed(mission: RunningMission, program: str, typed: str, shell: str) -> list[str]:
    """Return what a shell offers where the typed words end."""
    words = typed.split(" ")
    asked = {
        f"_{program.upper().replace('-', '_')}_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(words) - 1),
        "_TYPER_COMPLETE_ARGS": typed,
    }
    done = subprocess.run(
        [str(BIN / program)], env=mission.environment | asked, capture_output=True, text=True, timeout=30, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    return re.findall(r"[a-z0-9_-]+", done.stdout)


@pytest.mark.parametrize("shell", ["bash", "zsh"])
@pytest.mark.parametrize(
    ("program", "typed", "offered"),
    [
        ("scout-backbone", "scout-backbone why scout", {"scout1", "scout2", "scout3"}),
        ("scout-backbone", "scout-backbone story watch-", {"watch-scout1", "watch-scout1-capture"}),
        ("scout-backbone", "scout-backbone log --robot ra", {"radio"}),
        ("scout-console", "scout-console attach ", {"scout1", "scout2", "scout3"}),
    ],
)
def test_names_are_completed_from_the_mission_that_is_up(
    mission: RunningMission, shell: str, program: str, typed: str, offered: set[str]
) -> None:
    found = completed(mission, program, typed, shell)
    assert offered <= set(found)


def test_missions_that_are_up_are_completed(mission: RunningMission, tmp_path: Path) -> None:
    assert mission.name in completed(mission, "scout-backbone", "scout-backbone status --mission ", "bash")
