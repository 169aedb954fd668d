"""A whole mission in one process on virtual time, for the duration of one scene."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Protocol, TypeGuard, TypeVar

from backbone.bus.clock import run_virtual
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission, read_mission_bytes
from mission_control.laboratory.module_kit.encoding_network import EncodingNetwork
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process

Result = TypeVar("Result")


def play(mission: Path | str, scene: Callable[[RunningMission], Awaitable[Result]]) -> Result:
    """Run the scene while the mission is up, and return its result.

    Each message must be one that could cross the bus between processes; its sender gets the refusal otherwise.

    Args:
        mission: Path of a mission file, or its text; relative paths in a text refer to the working directory.
        scene: Called with the running mission, on virtual time.

    Raises:
        MissionInvalid: The file has faults; the error lists all of them.
        MissionFell: A component crashed, for example because its message cannot be sent.
        Refusal: A component could not be started.
    """
    description = described(mission)

    async def main() -> Result:
        async with mission_in_one_process(description, on=EncodingNetwork) as running:
            return await scene(running)

    return run_virtual(main())


def described(mission: Path | str) -> MissionDescription:
    """Return the mission of a file, or of its text.

    Raises:
        MissionInvalid: The file has faults; the error lists all of them.
    """
    return read_mission_bytes(mission.encode(), "mission.xml") if is_text(mission) else read_mission(mission)


def is_text(mission: Path | str) -> TypeGuard[str]:
    """Return whether this is a mission's text instead of the path of its file."""
    return isinstance(mission, str) and mission.lstrip().startswith("<")


class Play(Protocol):
    """Runs a mission for one scene."""

    def __call__(self, mission: Path | str, scene: Callable[[RunningMission], Awaitable[Result]]) -> Result:
        """Return the scene's result; see ``play``."""
