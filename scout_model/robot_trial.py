"""Trial of a kind of robot before a mission starts: can its body be built, and does its on-board program fit it?"""

from __future__ import annotations

import inspect
from contextlib import suppress
from pathlib import Path
from xml.parsers import expat

from scout_model.composition import require_body
from scout_model.description import RobotPlace, WorldDescription
from scout_model.errors import InvalidWorld
from scout_model.robot import robot_class
from scout_model.world import World

_ROOM_M = 4.0  # chosen: a robot of any size stands free
_OF_THE_ROOM = ("option", "visual")


def require_robot(kind: str) -> None:
    """Check that a robot of this kind stands in an empty room for one frame.

    Args:
        kind: Class path ``package.module:Class``. Its code runs, with the readings of its own body.

    Raises:
        InvalidWorld: There is no such kind, its body lacks a part that its program drives, has settings that are the
            room's, or cannot be built. The text names the body's file.
        Exception: Its program fails, for example because the body lacks a sensor.
    """
    mjcf = robot_class(kind).body_mjcf()
    where = _file_of(kind, mjcf)
    for tag, line in _settings(mjcf):
        raise InvalidWorld(f"{where}, line {line}: a body must not have <{tag}>, because the room's counts")
    require_body(kind)
    place = RobotPlace("robot", 1, _ROOM_M / 2, _ROOM_M / 2, 0.0, kind)
    try:
        World(WorldDescription(_ROOM_M, _ROOM_M, robots=[place])).step_frame()
    except InvalidWorld as error:
        raise InvalidWorld(f"{where}: {error.args[0]}") from error


def _file_of(kind: str, mjcf: str) -> str:
    """Return the file with this text beside the file of the class; if there is none, the method that returned it."""
    folder = Path(inspect.getfile(robot_class(kind))).parent
    same = (file for file in sorted(folder.glob("*.xml")) if file.read_text("utf-8", errors="replace") == mjcf)
    return str(next(same, f"body_mjcf of {kind}"))


def _settings(mjcf: str) -> list[tuple[str, int]]:
    """Return tag and line of each setting in the body that the room has already; of a body that is no XML, none."""
    found: list[tuple[str, int]] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, _: found.append((tag, parser.CurrentLineNumber))
    with suppress(expat.ExpatError):  # which MuJoCo reports, with its place
        parser.Parse(mjcf, True)
    return [(tag, line) for tag, line in found if tag in _OF_THE_ROOM]
