"""Detects that the terminal has gone away, because its window was closed or its connection cut.

If the controlling terminal of a process goes away, a signal ends the process. If the terminal is only its standard
input, there is no signal, and each read returns at once.
"""

from __future__ import annotations

import asyncio
import select
from collections.abc import Callable


class HangupWatch:
    """Calls back, in the event loop, when the other end of a terminal is closed.

    Args:
        descriptor: File descriptor of the terminal; the watch does not read its input.
        gone: Called once.
    """

    def __init__(self, descriptor: int, gone: Callable[[], None]) -> None:
        self._gone = gone
        self._loop = asyncio.get_running_loop()
        self._poll: select.epoll | None = select.epoll()
        try:
            self._poll.register(descriptor, 0)  # reports only hang-up and error, no input
        except PermissionError:  # a file never hangs up
            self.close()
            return
        self._loop.add_reader(self._poll.fileno(), self._hung_up)

    def close(self) -> None:
        """Stop watching. Idempotent."""
        if self._poll is not None:
            self._loop.remove_reader(self._poll.fileno())
            self._poll.close()
            self._poll = None

    def _hung_up(self) -> None:
        if self._poll is not None and self._poll.poll(0):
            self.close()
            self._gone()
