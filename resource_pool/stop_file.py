"""Stop file: keeps the emergency stop of a robot on its host, for the next process of its RC."""

from __future__ import annotations

import logging

import msgspec

from backbone.atomic_file import replace_file
from backbone.component.messages import MORE_THAN_ANY_STOP
from backbone.kept_file import KeptFile
from resource_pool.stop_messages import StopState

log = logging.getLogger(__name__)


class StopFile:
    """File of one robot's stop in the mission's folder.

    Args:
        run_directory: The mission's folder on this host; empty: nothing is kept.
        rc: Name of the robot.
    """

    def __init__(self, run_directory: str, rc: str) -> None:
        self._rc = rc
        self._file = KeptFile(run_directory, "stops", rc)

    def read(self) -> StopState | None:
        """Return the saved state; None: none was saved. A file that cannot be read counts as a stop."""
        try:
            saved = self._file.read()
            return None if saved is None else msgspec.msgpack.decode(saved, type=StopState)
        except (OSError, msgspec.DecodeError) as error:
            log.error("%s: %s", self._file.path, error)
            number, why = MORE_THAN_ANY_STOP, "the file of an earlier stop cannot be read"
            return StopState(self._rc, True, number, "unknown", why, 0.0)

    def write(self, state: StopState) -> None:
        """Replace the saved state, or raise ``OSError``; nothing is saved once the mission has ended."""
        if (target := self._file.target()) is not None:
            replace_file(target, msgspec.msgpack.encode(state), is_lasting=False)
