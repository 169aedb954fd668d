"""Names of a mission that is up on this machine, in its run folder: shells complete them without asking the mission.

The launcher writes the file whenever the names have changed, and removes it with the run folder. A file that cannot be
written is removed, so that no reader gets old names.
"""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

from backbone import run_files
from backbone.atomic_file import replace_file

FILE_NAME = "names.json"


class MissionNames(msgspec.Struct, frozen=True):
    """The names that a person types, each list sorted.

    Attributes:
        all: Components, requests, resources, hosts and people.
        resources: RCs.
        robots: RCs of robots.
        behaviors: Running behaviors.
        people: People at consoles.
        types: Component types.
    """

    all: list[str] = []
    resources: list[str] = []
    robots: list[str] = []
    behaviors: list[str] = []
    people: list[str] = []
    types: list[str] = []


def write(directory: Path, names: MissionNames) -> None:
    """Write the names for this user alone; if the system refuses, there is no file afterwards.

    Raises:
        OSError: The system refused.
    """
    path = directory / FILE_NAME
    try:
        os.close(os.open(path, os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_WRONLY, 0o600))
        replace_file(path, msgspec.json.encode(names), is_lasting=False)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def read(mission: str | None) -> MissionNames | None:
    """Return the names of a mission that is up on this machine; None: they cannot be read.

    Args:
        mission: Its name; None: the only mission.

    Raises:
        MissionNotUp: The mission is not up.
        SeveralMissions: ``mission`` is None and several missions are up.
    """
    path = run_files.run_directory(run_files.find(mission).mission) / FILE_NAME
    try:
        return msgspec.json.decode(path.read_bytes(), type=MissionNames)
    except (OSError, msgspec.DecodeError):  # an empty file is being written for the first time
        return None
