"""The launcher or its zygote keeps how a mission ended unexpectedly, and a command that finds no mission quotes it."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from full_disk import disk_full_at

from backbone import run_files, unexpected_ends
from backbone.errors import BackboneError
from backbone.launcher.outcome import Outcome
from backbone.run_files import MissionNotUp, RunFile


@pytest.fixture(autouse=True)
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return run_files.run_directory("m").parent


def refusal(mission: str | None = None) -> str:
    with pytest.raises(MissionNotUp) as refused:
        run_files.find(mission)
    return refused.value.detail


def test_a_command_that_finds_no_mission_says_how_the_last_one_ended(directory: Path) -> None:
    unexpected_ends.keep(directory / "day", "its launcher was killed")
    unexpected_ends.keep(directory / "night", "SIGHUP")
    hour = time.strftime("%Y-%m-%d %H:")
    assert f"; mission night ended at {hour}" in refusal()
    assert refusal().endswith(": SIGHUP")
    assert refusal("day").endswith(": its launcher was killed")
    assert refusal("dusk") == "mission 'dusk' is not up; up: none"
    assert refusal("*") == "mission '*' is not up; up: none"


def test_it_is_forgotten_when_a_mission_of_its_name_comes_up_or_ends_as_ordered(directory: Path) -> None:
    for forget in (lambda: run_files.prepare("night"), lambda: unexpected_ends.keep(directory / "night", "")):
        unexpected_ends.keep(directory / "night", "SIGHUP")
        assert refusal("night").endswith(": SIGHUP")
        forget()
        assert refusal("night") == "mission 'night' is not up; up: none"


def test_a_mission_that_is_up_is_found_beside_ends_of_others(directory: Path) -> None:
    unexpected_ends.keep(directory / "night", "SIGHUP")
    run_files.prepare("day")
    run_files.write(RunFile("day", "tcp/127.0.0.1:7447", os.getpid(), 12.5, 2.0, "lab", "/missions/m.xml"))
    assert run_files.find().mission == "day"
    run_files.unlist(directory / "day")
    run_files.unlist(directory / "day")
    assert "mission night ended" in refusal()


def test_what_another_release_has_kept_is_no_fault(directory: Path) -> None:
    unexpected_ends.keep(directory / "night", "SIGHUP")
    for content in (b'{"mission":"night"}', b'{"mission":"night","at_s":1e300,"how":"SIGHUP"}', b"\xff"):
        (directory / ".night.end").write_bytes(content)
        assert refusal() == "no mission is up on this machine for this user"
    (directory / ".day.end").mkdir()
    assert refusal() == "no mission is up on this machine for this user"


def test_on_a_full_disk_or_without_its_folder_nothing_is_kept(directory: Path) -> None:
    with disk_full_at(10):
        unexpected_ends.keep(directory / "night", "SIGHUP")
    unexpected_ends.keep(directory / "gone" / "night", "SIGHUP")
    unexpected_ends.keep(directory / "gone" / "night", "")
    assert refusal() == "no mission is up on this machine for this user"


@pytest.mark.parametrize(
    ("outcome", "how"),
    [
        (Outcome(order="SIGHUP"), ""),  # it was coming up, and the command that waits says so
        (Outcome(1.0, order="ordered by down-7"), ""),
        (Outcome(1.0, order="SIGTERM"), ""),
        (Outcome(1.0, order="SIGHUP"), "SIGHUP, as its terminal was closed"),
        (Outcome(1.0, BackboneError("no folder"), "no folder"), "no folder"),
        (Outcome(1.0, RuntimeError("no thread")), "its launcher failed: RuntimeError: no thread"),
    ],
)
def test_an_end_is_unexpected_if_no_person_or_service_manager_ordered_it(outcome: Outcome, how: str) -> None:
    assert outcome.unexpected_end == how
