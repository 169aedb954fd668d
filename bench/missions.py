"""A real mission for a program in bench/: it is up while a block runs, and ends with the block, after an error too."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from mission_control.laboratory.module_kit import real_mission
from mission_control.laboratory.module_kit.real_mission import RealMission

__all__ = ["RealMission", "mission_up", "own_processes"]


@contextmanager
def mission_up(mission: Path | str, *options: str, name: str = "") -> Iterator[RealMission]:
    """Yield a mission that is ready; see ``real_mission.mission_up``.

    Until the block ends, this program and those that it starts find the mission in its runtime folder. The mission file
    can name classes of the files in bench/.
    """
    os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    with (
        real_mission.mission_up(mission, *options, name=name) as running,
        real_mission.runtime_directory(running.environment["XDG_RUNTIME_DIR"]),
    ):
        yield running


def own_processes(running: RealMission) -> list[psutil.Process]:
    """Return the launcher of the mission and its descendants, without other programs."""
    launcher = psutil.Process(running.launcher.pid)
    return [launcher, *launcher.children(recursive=True)]
