"""Stops file: keeps the last emergency stop of each robot for the next nameserver of the mission."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from backbone.component.messages import MORE_THAN_ANY_STOP, LastStop, StandingStop

log = logging.getLogger(__name__)

FILE_NAME = "last-stops"
UNREADABLE = LastStop(
    MORE_THAN_ANY_STOP,
    StandingStop(MORE_THAN_ANY_STOP, "unknown", "the nameserver's file of stops cannot be read", 0.0),
)


class StopsFile:
    """File of the last emergency stops in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
    """

    def __init__(self, run_directory: str) -> None:
        self._path = Path(run_directory) / FILE_NAME if run_directory else None
        self._kept: dict[str, LastStop] = {}

    def read(self) -> dict[str, LastStop] | None:
        """Return the saved stops by the names of their robots; None: the file cannot be read, so any may be stopped."""
        if self._path is None:
            return {}
        try:
            self._kept = msgspec.msgpack.decode(self._path.read_bytes(), type=dict[str, LastStop])
        except (FileNotFoundError, NotADirectoryError):
            return {}
        except (OSError, msgspec.DecodeError) as error:
            log.error("%s: %s; a robot of which nothing is known counts as stopped", self._path, error)
            return None
        return dict(self._kept)

    def keep(self, stops: Mapping[str, LastStop]) -> None:
        """Save these stops if they differ from the saved ones, or raise ``OSError``."""
        if self._path is not None and stops != self._kept:
            self._kept = dict(stops)
            replace_file(self._path, msgspec.msgpack.encode(self._kept), is_lasting=False)
