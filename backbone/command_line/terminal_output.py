"""Writes to a terminal or pipe; a reader that does not read holds up nothing.

Otherwise the event loop would wait for the reader, and with it a robot, an emergency stop, a mission and SIGTERM.
"""

from __future__ import annotations

import io
import os
import selectors
import threading
import time
from collections import deque
from collections.abc import Callable

BEHIND_S = 0.5  # chosen: an operator has no use for an older picture; a terminal that is read takes each at once
MOST_WAITING_BYTES = 1 << 20  # chosen: the lines of a day in which much happens


class TerminalOutput:
    """The output of one terminal or pipe.

    Law: ``write`` returns at once, in order, and never a part of a text is lost. Pictures are dropped if the terminal
    has not taken a text for ``BEHIND_S``, and everything if ``MOST_WAITING_BYTES`` wait; once the terminal has taken
    what waited, ``caught_up`` is called.

    Args:
        descriptor: File descriptor of the terminal or pipe.
        caught_up: Called in another thread after texts were dropped: a picture has to be drawn anew.

    Attributes:
        drops: True: texts are pictures. False: they are lines, or change the terminal's mode.
    """

    def __init__(self, descriptor: int, caught_up: Callable[[], None], encoding: str = "utf-8") -> None:
        self.drops = True
        self._descriptor, self._caught_up, self._encoding = descriptor, caught_up, encoding
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._waiting_bytes = 0
        self._has_dropped = self._is_gone = False
        self._news = threading.Condition()
        threading.Thread(target=self._run, name="terminal-output", daemon=True).start()

    @property
    def is_terminal(self) -> bool:
        """Whether it is a terminal."""
        return os.isatty(self._descriptor)

    def write(self, text: str) -> None:
        """Write the text as soon as the terminal takes it."""
        now_s = time.monotonic()
        with self._news:
            is_behind = self.drops and self._waiting and now_s > self._waiting[0][0] + BEHIND_S
            if is_behind or self._waiting_bytes > MOST_WAITING_BYTES:
                self._has_dropped = True
            elif not self._is_gone:
                said = text.encode(self._encoding, "backslashreplace")
                self._waiting.append((now_s, said))
                self._waiting_bytes += len(said)
                self._news.notify_all()

    def wait_written(self, within_s: float) -> bool:
        """Wait until the terminal has taken everything; return False if it did not within this time."""
        with self._news:
            return self._news.wait_for(lambda: not self._waiting, within_s)

    def _run(self) -> None:
        while not self._is_gone:
            with self._news:
                self._news.wait_for(lambda: self._waiting)
                text = self._waiting[0][1]
            is_gone = not self._taken(text)
            with self._news:
                self._is_gone = is_gone
                if is_gone:
                    self._waiting.clear()
                else:
                    self._waiting.popleft()
                    self._waiting_bytes -= len(text)
                has_dropped = self._has_dropped and not self._waiting
                if has_dropped:
                    self._has_dropped = False
                self._news.notify_all()
            if has_dropped:
                self._caught_up()

    def _taken(self, text: bytes) -> bool:
        """Wait until the terminal has taken the text; return False if the terminal is gone."""
        while text:
            try:
                text = text[os.write(self._descriptor, text) :]
            except BlockingIOError:  # an earlier program set the terminal to non-blocking
                with selectors.SelectSelector() as waiting:
                    waiting.register(self._descriptor, selectors.EVENT_WRITE)
                    waiting.select()
            except OSError:
                return False
        return True


class TerminalFile(io.TextIOBase):
    """A text file for printing by a ``TerminalOutput``."""

    def __init__(self, output: TerminalOutput) -> None:
        super().__init__()
        self._output = output

    def write(self, text: str) -> int:
        """Write the text as soon as the terminal takes it."""
        self._output.write(text)
        return len(text)

    def isatty(self) -> bool:
        """Return whether the output is a terminal."""
        return self._output.is_terminal
