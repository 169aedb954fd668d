"""The file of the schedule trace: whole lines, in the order of the decisions, without a gap.

If a line cannot be written, the mission continues: the trace stops, with whole lines only, and the mission's log has
the reason. It is not continued later, because a judge would blame the scheduler for the missing lines.
"""

from __future__ import annotations

import contextlib
import json
import os

from backbone.atomic_file import write_all
from backbone.scheduling.trace import Line


class TraceFile:
    """Appends to the file at this path.

    Args:
        path: The file; empty: no trace.
    """

    def __init__(self, path: str) -> None:
        self._descriptor: int | None = None
        self.stopped_by = ""
        """The error that ended the trace early; empty: no error."""
        if not path:
            return
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as error:
            self.stopped_by = f"{path}: {error.strerror}"

    def write(self, line: Line) -> bool:
        """Append the line; return False if this line ended the trace, see ``stopped_by``."""
        if self._descriptor is None:
            return True
        end = os.fstat(self._descriptor).st_size
        try:
            write_all(self._descriptor, json.dumps(line).encode() + b"\n")
        except OSError as error:
            self.stopped_by = str(error.strerror)
            with contextlib.suppress(OSError):  # a device or pipe, no file
                os.ftruncate(self._descriptor, end)
            self.close()
            return False
        return True

    def close(self) -> None:
        """End the trace; idempotent."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
