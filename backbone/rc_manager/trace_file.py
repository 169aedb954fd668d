"""The file of the schedule trace: whole lines, in the order of the decisions, without a gap.

A thread writes the lines, because a slow disk must not delay a decision: 4 s were measured until an operator had a
robot. If the RC manager is killed, its last lines may be missing.

If a line cannot be written, the mission continues: the trace stops, with whole lines only, and the mission's log has
the reason. It is not continued later, because a judge would blame the scheduler for the missing lines.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
from collections import deque
from collections.abc import Callable

from backbone.atomic_file import write_all
from backbone.scheduling.trace import Line

MOST_WAITING = 100_000  # chosen: lines of an hour of a busy mission, some 20 MB
CLOSE_WITHIN_S = 2.0  # chosen: a slow disk takes some lines a second; machine seconds


class TraceFile:
    """Appends to the file at this path.

    Args:
        path: The file; empty: no trace.
        stopped: Called once in the event loop if the trace ends early after its begin; see ``stopped_by``.
    """

    def __init__(self, path: str, stopped: Callable[[], None] = lambda: None) -> None:
        self._stopped = stopped
        self._waiting: deque[bytes] = deque()
        self._writing: asyncio.Future[str] | None = None
        self._descriptor: int | None = None
        self.stopped_by = ""
        """The error that ended the trace early; empty: no error."""
        if not path:
            return
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as error:
            self.stopped_by = f"{path}: {error.strerror}"

    def write(self, line: Line) -> None:
        """Append the line soon; after an error, or without a file, do nothing."""
        if self._descriptor is None or self.stopped_by:
            return
        if len(self._waiting) >= MOST_WAITING:
            self._stop("the disk is too slow")
            return
        self._waiting.append(json.dumps(line).encode() + b"\n")
        self._write_on()

    async def close(self) -> None:
        """Return when all lines are written, or cannot be within ``CLOSE_WITHIN_S``; idempotent."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CLOSE_WITHIN_S):
                while self._writing is not None:
                    await asyncio.wait([self._writing])
        if self._writing is not None and not self.stopped_by:
            self._stop("the disk was too slow for the last lines")
        self._close()

    def _write_on(self) -> None:
        if self._writing is None and self._waiting and self._descriptor is not None:
            loop = asyncio.get_running_loop()
            self._writing = loop.run_in_executor(None, self._write_waiting, self._descriptor)
            self._writing.add_done_callback(self._written)

    def _write_waiting(self, descriptor: int) -> str:
        """Write the waiting lines, in a thread; return the error that ended the trace, if any."""
        with contextlib.suppress(IndexError):  # none is left
            while line := self._waiting.popleft():
                end = os.fstat(descriptor).st_size
                try:
                    write_all(descriptor, line)
                except OSError as error:
                    with contextlib.suppress(OSError):  # a device or pipe, no file
                        os.ftruncate(descriptor, end)
                    return str(error.strerror)
        return ""

    def _written(self, writing: asyncio.Future[str]) -> None:
        self._writing = None
        if (error := writing.result()) and not self.stopped_by:
            self._stop(error)
        elif self.stopped_by:
            self._close()
        else:
            self._write_on()

    def _stop(self, why: str) -> None:
        self.stopped_by = why
        self._waiting.clear()
        self._close()
        self._stopped()

    def _close(self) -> None:
        if self._descriptor is not None and self._writing is None:  # else its thread uses it
            os.close(self._descriptor)
            self._descriptor = None
