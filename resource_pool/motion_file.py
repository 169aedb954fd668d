"""Motion file: keeps the last motions of a robot on its host, for the next process of its RC."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import msgspec

from backbone.atomic_file import replace_file
from backbone.kept_file import KeptFile
from resource_pool.messages import Applied

log = logging.getLogger(__name__)


class MotionFile:
    """File of one robot's motions in the mission's folder: the time since which none is missing, and a line for each.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        rc: Name of the robot.
    """

    def __init__(self, run_directory: str, rc: str) -> None:
        self._file = KeptFile(run_directory, "motions", rc)

    def read(self) -> tuple[float, list[Applied]] | None:
        """Return since when the motions are whole, and the motions; None: none were kept, or they cannot be read."""
        try:
            saved = self._file.read()
            if saved is None:
                return None
            first, *lines, _torn = saved.split(b"\n")
            motions = [msgspec.json.decode(line, type=Applied) for line in lines]
            return msgspec.json.decode(first, type=float), motions
        except (OSError, ValueError) as error:  # msgspec.DecodeError is one
            log.warning("%s: %s", self._file.path, error)
            return None

    def begin(self, begun_s: float, motions: Iterable[Applied]) -> None:
        """Replace the file's content; once the mission has ended, nothing is kept."""
        try:
            if (target := self._file.target()) is not None:
                lines = [msgspec.json.encode(begun_s), *map(msgspec.json.encode, motions), b""]
                replace_file(target, b"\n".join(lines), is_lasting=False)
        except OSError as error:
            self._give_up(error)

    def add(self, motion: Applied) -> None:
        """Add a motion to the file; after an error nothing is kept."""
        try:
            if (path := self._file.path) is not None:
                with path.open("ab", buffering=0) as file:
                    file.write(msgspec.json.encode(motion) + b"\n")
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        """Remove the file: a motion is missing in it."""
        path = self._file.path
        self._file.give_up()
        log.warning("%s: a restart of this RC will not know its motions: %s", path, error)
        try:
            if path is not None:
                path.unlink(missing_ok=True)
        except OSError as still:
            log.warning("%s: %s", path, still)
