"""Stops file: keeps the emergency stops in force for the next nameserver of the mission."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from backbone.component.messages import StandingStop

log = logging.getLogger(__name__)

FILE_NAME = "stops-in-force"
MORE_THAN_ANY = 1_000_000  # chosen: more orders to stop than any mission has, so no host knows a later one
UNREADABLE = StandingStop(MORE_THAN_ANY, "unknown", "the nameserver's file of stops cannot be read", 0.0)


class StopsFile:
    """File of the emergency stops in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
    """

    def __init__(self, run_directory: str) -> None:
        self._path = Path(run_directory) / FILE_NAME if run_directory else None
        self._kept: dict[str, StandingStop] = {}

    def read(self) -> dict[str, StandingStop] | None:
        """Return the saved stops by the names of their robots; None: the file cannot be read, so any may be stopped."""
        if self._path is None:
            return {}
        try:
            self._kept = msgspec.msgpack.decode(self._path.read_bytes(), type=dict[str, StandingStop])
        except (FileNotFoundError, NotADirectoryError):
            return {}
        except (OSError, msgspec.DecodeError) as error:
            log.error("%s: %s; a robot of which nothing is known counts as stopped", self._path, error)
            return None
        return dict(self._kept)

    def keep(self, stops: Mapping[str, StandingStop]) -> None:
        """Save these stops if they differ from the saved ones, or raise ``OSError``."""
        if self._path is not None and stops != self._kept:
            self._kept = dict(stops)
            replace_file(self._path, msgspec.msgpack.encode(self._kept), is_lasting=False)
