"""How missions of this machine ended unexpectedly: a small file each, until a mission of the same name comes up.

A mission in the background has no terminal, and its folder with all logs is removed with it. So this file is beside
that folder, and a command that finds no mission quotes it.
"""

from __future__ import annotations

import contextlib
import time
from datetime import datetime
from pathlib import Path
from typing import Annotated

import msgspec

from backbone.atomic_file import replace_file

LATEST_S = 250_000_000_000.0  # in the year 9892; dates end with the year 9999
SUFFIX = ".end"  # the file of a mission is .<mission>.end, no legal name of a mission


class UnexpectedEnd(msgspec.Struct, frozen=True):
    """An end of a mission that no person ordered.

    Attributes:
        at_s: Time of day of the end, Unix time.
        how: What ended it, one sentence without a full stop.
    """

    mission: str
    at_s: Annotated[float, msgspec.Meta(ge=0.0, lt=LATEST_S)]
    how: str

    def __str__(self) -> str:
        at = datetime.fromtimestamp(self.at_s).astimezone()
        return f"mission {self.mission} ended at {at:%Y-%m-%d %H:%M:%S}: {self.how}"


def keep(folder: Path, how: str) -> None:
    """Keep how the mission of this folder ended now, unless the system refuses to write the file.

    Args:
        how: What ended it; empty: its end was expected, and nothing is kept.
    """
    end = UnexpectedEnd(folder.name, time.time(), how)
    with contextlib.suppress(OSError):
        if how:
            replace_file(_path(folder), msgspec.json.encode(end), is_lasting=False)
        else:
            forget(folder)


def forget(folder: Path) -> None:
    """Remove what is kept about the mission of this folder. Idempotent."""
    _path(folder).unlink(missing_ok=True)


def newest(directory: Path, mission: str | None = None) -> UnexpectedEnd | None:
    """Return the newest end that is kept; None: none is.

    Args:
        directory: Folder of the missions' folders.
        mission: Only of this mission; None: of any.
    """
    kept = (_read(path) for path in directory.glob(f".*{SUFFIX}"))
    found = (end for end in kept if end is not None and mission in (None, end.mission))
    return max(found, key=lambda end: end.at_s, default=None)


def _path(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}{SUFFIX}")


def _read(path: Path) -> UnexpectedEnd | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=UnexpectedEnd) if path.is_file() else None
    except (OSError, msgspec.DecodeError):  # of another release
        return None
