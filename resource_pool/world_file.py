"""World file: keeps where the simulated bodies are, for the next process of the simulated world."""

from __future__ import annotations

import logging
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from scout_model.world import WorldMemory

log = logging.getLogger(__name__)


class WorldFile:
    """File of one simulated world in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        world: Name of the world.
    """

    def __init__(self, run_directory: str, world: str) -> None:
        self._path = Path(run_directory) / "worlds" / world if run_directory else None

    def read(self) -> WorldMemory | None:
        """Return what an earlier process saved; None: nothing, or it cannot be read."""
        if self._path is None:
            return None
        try:
            return msgspec.msgpack.decode(self._path.read_bytes(), type=WorldMemory)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, msgspec.DecodeError) as error:
            log.warning("%s: the robots begin at their first places: %s", self._path, error)
            return None

    def write(self, memory: WorldMemory) -> None:
        """Replace what is saved; after an error nothing more is."""
        if self._path is None:
            return
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            replace_file(self._path, msgspec.msgpack.encode(memory), is_lasting=False)
        except OSError as error:
            log.warning("%s: after a restart the robots begin where they are now: %s", self._path, error)
            self._path = None

    def forget(self) -> None:
        """Remove what is saved."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)
