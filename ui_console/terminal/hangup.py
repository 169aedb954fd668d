"""Notice that the terminal has gone away: its window was closed, its connection cut.

The controlling terminal of a process ends it with a signal. A terminal that is only its standard input does not, and
reading from it then returns at once, for ever.
"""

from __future__ import annotations

import asyncio
import select
from collections.abc import Callable


class HangupWatch:
    """Calls back, in the event loop, when the other end of a terminal is closed.

    Args:
        descriptor: Of the terminal; the watch reads none of its input.
        gone: Called once.
    """

    def __init__(self, descriptor: int, gone: Callable[[], None]) -> None:
        self._gone = gone
        self._loop = asyncio.get_running_loop()
        self._poll: select.epoll | None = select.epoll()
        try:
            self._poll.register(descriptor, 0)  # reports hang-up and error in any case, and no input
        except PermissionError:  # a file: it never hangs up
            self.close()
            return
        self._loop.add_reader(self._poll.fileno(), self._hung_up)

    def close(self) -> None:
        """Stop watching. Closing twice is allowed."""
        if self._poll is not None:
            self._loop.remove_reader(self._poll.fileno())
            self._poll.close()
            self._poll = None

    def _hung_up(self) -> None:
        if self._poll is not None and self._poll.poll(0):
            self.close()
            self._gone()
