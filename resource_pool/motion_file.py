"""Motion file: keeps the last motions of a robot on its host, for the next process of its RC."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from resource_pool.messages import Applied

log = logging.getLogger(__name__)


class MotionFile:
    """File of one robot's motions in the mission's folder: the time since which none is missing, and a line for each.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        rc: Name of the robot.
    """

    def __init__(self, run_directory: str, rc: str) -> None:
        self._path = Path(run_directory) / "motions" / rc if run_directory else None

    def read(self) -> tuple[float, list[Applied]] | None:
        """Return since when the motions are whole, and the motions; None: none were kept, or they cannot be read."""
        if self._path is None:
            return None
        try:
            first, *lines, _torn = self._path.read_bytes().split(b"\n")
            motions = [msgspec.json.decode(line, type=Applied) for line in lines]
            return msgspec.json.decode(first, type=float), motions
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, ValueError) as error:  # msgspec.DecodeError is one
            log.warning("%s: %s", self._path, error)
            return None

    def begin(self, begun_s: float, motions: Iterable[Applied]) -> None:
        """Replace the file's content."""
        if self._path is not None:
            lines = [msgspec.json.encode(begun_s), *map(msgspec.json.encode, motions), b""]
            try:
                self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                replace_file(self._path, b"\n".join(lines), is_lasting=False)
            except OSError as error:
                self._give_up(self._path, error)

    def add(self, motion: Applied) -> None:
        """Add a motion to the file; after an error nothing is kept."""
        if self._path is not None:
            try:
                with self._path.open("ab", buffering=0) as file:
                    file.write(msgspec.json.encode(motion) + b"\n")
            except OSError as error:
                self._give_up(self._path, error)

    def _give_up(self, path: Path, error: OSError) -> None:
        """Remove the file: a motion is missing in it."""
        log.warning("%s: a restart of this RC will not know its motions: %s", path, error)
        self._path = None
        try:
            path.unlink(missing_ok=True)
        except OSError as still:
            log.warning("%s: %s", path, still)
