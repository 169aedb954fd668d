"""Reads a mission file in a forked child, so that the readers of mission files take no memory of the launcher: 12 MB.

If the child does not answer, this process reads the file itself, and has the same fault as the child.
"""

from __future__ import annotations

import importlib
import pickle
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from backbone.mission.report import Fault, MissionInvalid
from backbone.operating_system import own_process, processes
from backbone.operating_system.forked_child import ForkedChild

if TYPE_CHECKING:
    from backbone.mission.model import MissionDescription

    Written = tuple[MissionDescription, bytes]


def begin_reading(path: Path) -> Callable[[], Written]:
    """Begin to read the file; the result is a function that waits for its end, to be called once.

    The function returns what ``read_written_mission`` returns, and raises what that raises.
    """
    try:
        child = ForkedChild(partial(_answer, path)) if processes.threads() == 1 else None
    except OSError:  # the system has no process or no memory left
        child = None
    return partial(_finished, child, path)


def _finished(child: ForkedChild | None, path: Path) -> Written:
    answer = None if child is None else child.answer()
    if answer is None:
        return _read(path)
    mission, text, faults = pickle.loads(answer)  # noqa: S301  from a copy of this process
    if faults:
        raise MissionInvalid(faults)
    return mission, text


def _answer(path: Path) -> bytes:
    own_process.die_with_parent()  # a class of the mission may be slow to import
    faults: tuple[Fault, ...] = ()
    try:
        mission, text = _read(path)
    except MissionInvalid as invalid:
        mission, text, faults = None, b"", invalid.faults
    return pickle.dumps((mission, text, faults))


def _read(path: Path) -> Written:
    found: Written = importlib.import_module("backbone.mission.reader").read_written_mission(path)
    return found
