"""World file: keeps where the simulated bodies are, for the next process of the simulated world."""

from __future__ import annotations

import logging

import msgspec

from backbone.atomic_file import replace_file
from backbone.kept_file import KeptFile
from scout_model.world import WorldMemory

log = logging.getLogger(__name__)


class WorldFile:
    """File of one simulated world in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        world: Name of the world.
    """

    def __init__(self, run_directory: str, world: str) -> None:
        self._file = KeptFile(run_directory, "worlds", world)

    def read(self) -> WorldMemory | None:
        """Return what an earlier process saved; None: nothing, or it cannot be read."""
        try:
            saved = self._file.read()
            return None if saved is None else msgspec.msgpack.decode(saved, type=WorldMemory)
        except (OSError, msgspec.DecodeError) as error:
            log.warning("%s: the robots begin at their first places: %s", self._file.path, error)
            return None

    def write(self, memory: WorldMemory) -> None:
        """Replace what is saved; after an error, or once the mission has ended, nothing more is."""
        try:
            if (target := self._file.target()) is not None:
                replace_file(target, msgspec.msgpack.encode(memory), is_lasting=False)
        except OSError as error:
            log.warning("%s: after a restart the robots begin where they are now: %s", self._file.path, error)
            self._file.give_up()

    def forget(self) -> None:
        """Remove what is saved."""
        if (path := self._file.path) is not None:
            path.unlink(missing_ok=True)
