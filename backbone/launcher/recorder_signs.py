"""Signs of life of a recorder to the process that started it: lines on its standard output, which has no other use.

A recorder prints one after a flush. If its event loop, its disc or its process hangs, it prints none.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress

EACH_S = 1.0  # chosen: a hung recorder is reported within seconds, and a line each second costs nothing
LATE_S = 1.5  # chosen: half a second more than the interval, for a busy machine
MOST_LATE = 2  # chosen: a watcher that was paused itself sees one late line, and the next in time
READ_BYTES = 4096  # chosen: far more than waits; a module of the mission may print a progress bar, too


class RecorderSigns:
    """Prints the signs. Never blocks, and does nothing when no process reads them any more."""

    def __init__(self) -> None:
        self._number, self._next_s = sys.stdout.fileno(), 0.0
        os.set_blocking(self._number, False)

    def give(self) -> None:
        """Print a sign if the last one is at least ``EACH_S`` old."""
        now_s = time.monotonic()
        if now_s >= self._next_s:
            self._next_s = now_s + EACH_S
            with suppress(BlockingIOError, BrokenPipeError):
                os.write(self._number, b"\n")


async def watch(signs: asyncio.StreamReader, silent: Callable[[bool], None]) -> None:
    """Call ``silent(True)`` when no signs come, and ``silent(False)`` when they come again; return at the end.

    When: after the recorder has reported that it listens. Until then, the component that started it limits the time.
    """
    late, some = 0, b"\n"
    while some:
        try:
            async with asyncio.timeout(LATE_S):
                some = await signs.read(READ_BYTES)
        except TimeoutError:
            late += 1
            if late == MOST_LATE:
                silent(True)
            continue
        if late >= MOST_LATE:
            silent(False)
        late = 0
