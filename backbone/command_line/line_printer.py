"""Lines on standard output, printed beside the event loop: a reader that does not read holds up no end."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue

from backbone.printable_text import printable_lines
from backbone.waiting import in_thread_within

MOST_WAITING_BYTES = 16 * 1024 * 1024  # chosen: far more than a person can read
READ_EACH_S = 2.0  # chosen: a slow reader takes the next bytes within this; seconds of the machine


class LinePrinter:
    """Prints lines in a thread, until ``end``.

    Args:
        failed: Called in the event loop when the output cannot be written, such as to a reader that has gone.
    """

    def __init__(self, failed: Callable[[], None]) -> None:
        self._lines: SimpleQueue[bytes] = SimpleQueue()
        self._failed, self._loop = failed, asyncio.get_running_loop()
        self._put_bytes, self._printed_bytes = 0, 0
        self._error: OSError | None = None
        self.dropped = 0
        """Number of lines that the reader did not get because it was too slow."""
        self.is_stuck = False
        """Whether the reader had stopped to read when the last line was due."""
        self._thread = threading.Thread(target=self._print, daemon=True)
        self._thread.start()

    def put(self, line: str) -> None:
        """Print a line as printable text, soon."""
        said = printable_lines(line, most=sys.maxsize)
        self.put_bytes(said.encode(sys.stdout.encoding, sys.stdout.errors or "strict"))

    def put_bytes(self, line: bytes) -> None:
        """Print a line as it is, soon."""
        said = line + b"\n"
        if self._put_bytes - self._printed_bytes > MOST_WAITING_BYTES:
            self.dropped += 1
            return
        self._put_bytes += len(said)
        self._lines.put(said)

    async def end(self) -> None:
        """Return when all lines are printed, or when the reader has read nothing for ``READ_EACH_S``.

        Raises:
            OSError: The output could not be written.
        """
        self._lines.put(b"")
        before = -1
        while self._thread.is_alive() and self._printed_bytes > before:
            before = self._printed_bytes
            with suppress(TimeoutError):
                await in_thread_within(self._thread.join, READ_EACH_S)
        if self._error is not None:
            raise self._error
        if self._thread.is_alive():
            self.is_stuck = True
            self.dropped += self._lines.qsize()

    def _print(self) -> None:
        try:
            while said := self._lines.get():
                while said:
                    written = os.write(sys.stdout.fileno(), said)
                    self._printed_bytes += written
                    said = said[written:]
        except OSError as error:
            self._error = error
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._failed)
