"""Stop file: keeps the emergency stop of a robot on its host, for the next process of its RC."""

from __future__ import annotations

import logging
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from resource_pool.stop_messages import StopState

log = logging.getLogger(__name__)


class StopFile:
    """File of one robot's stop in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        rc: Name of the robot.
    """

    def __init__(self, run_directory: str, rc: str) -> None:
        self._path = Path(run_directory) / "stops" / rc if run_directory else None

    def read(self) -> StopState | None:
        """Return the saved state; None: none was saved. A file that cannot be read counts as a stop."""
        if self._path is None:
            return None
        try:
            return msgspec.msgpack.decode(self._path.read_bytes(), type=StopState)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, msgspec.DecodeError) as error:
            log.error("%s: %s", self._path, error)
            return StopState(self._path.name, True, 1, "unknown", "the file of an earlier stop cannot be read", 0.0)

    def write(self, state: StopState) -> None:
        """Replace the saved state, or raise ``OSError``."""
        if self._path is not None:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            replace_file(self._path, msgspec.msgpack.encode(state), is_lasting=False)
