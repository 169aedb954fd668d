"""A real mission for this project's tests: ``mission.xml``, unless they name another file."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

from typer.testing import CliRunner

from backbone.command_line.cli import app
from mission_control.laboratory.module_kit import real_mission
from mission_control.laboratory.module_kit.real_mission import BIN, MARK, marked, runtime_directory, wait_gone
from mission_control.laboratory.module_kit.real_mission import RealMission as RunningMission

__all__ = [
    "BIN",
    "MARK",
    "MISSION_XML",
    "RunningMission",
    "asked",
    "marked",
    "mission_up",
    "runtime_directory",
    "status_when_settled",
    "wait_gone",
]

SETTLED_WITHIN_S = 30.0
MISSION_XML = Path(__file__).parents[2] / "mission.xml"


def mission_up(
    *options: str,
    name: str = "",
    mission_xml: Path = MISSION_XML,
    change: dict[str, str] | None = None,
    beside: RunningMission | None = None,
) -> AbstractContextManager[RunningMission]:
    """Bring a mission up; see ``real_mission.mission_up``."""
    return real_mission.mission_up(mission_xml, *options, name=name, change=change, beside=beside)


def asked(mission: RunningMission, *words: str) -> CompletedProcess[str]:
    """Run ``scout-backbone`` with these words against the mission, in this process: no interpreter starts for it."""
    with runtime_directory(mission.environment["XDG_RUNTIME_DIR"]):
        done = CliRunner().invoke(app, [*words, "--mission", mission.name], catch_exceptions=False)
    return CompletedProcess(words, done.exit_code, done.stdout, done.stderr)


def status_when_settled(mission: RunningMission) -> dict[str, Any]:
    """Return its status as soon as it is whole: ARCs start a moment after the mission is ready."""
    deadline = time.monotonic() + SETTLED_WITHIN_S
    while (found := mission.status())["health"] != "ok" or found["problems"]:
        assert time.monotonic() < deadline, f"{found}\n{mission.story()}"
        time.sleep(0.05)
    return found
