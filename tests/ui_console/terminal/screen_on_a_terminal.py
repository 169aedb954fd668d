"""A screen in a process of its own, on a terminal that a test plays."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

WITHIN_S = 10.0


@dataclass
class PlayedTerminal:
    """The test's end of the terminal, and the process at the other end."""

    terminal: int
    screen: subprocess.Popen[bytes]

    def type(self, keys: bytes) -> None:
        """Type these keys."""
        os.write(self.terminal, keys)

    def wait_shown(self, what: bytes) -> bytes:
        """Return all bytes that arrived until these did."""
        shown, deadline = b"", time.monotonic() + WITHIN_S
        while what not in shown:
            assert time.monotonic() < deadline, shown
            if select.select([self.terminal], [], [], 1.0)[0]:
                shown += os.read(self.terminal, 1 << 16)
        return shown


@contextlib.contextmanager
def screen_on_a_terminal(
    program: str, variables: Mapping[str, str] | None = None, *, errors_to: int | None = None
) -> Iterator[PlayedTerminal]:
    """Run the program on a terminal of its own until the block ends, outside a multiplexer.

    Args:
        program: In Python.
        variables: Of its environment.
        errors_to: Standard error, if it is not the terminal.
    """
    terminal, its_end = pty.openpty()
    known = {name: value for name, value in os.environ.items() if name not in {"TMUX", "STY"}}
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env={**known, "TERM": "xterm-256color", **(variables or {})},
        stdin=its_end,
        stdout=its_end,
        stderr=its_end if errors_to is None else errors_to,
        start_new_session=True,
        close_fds=False,
    ) as screen:
        try:
            yield PlayedTerminal(terminal, screen)
        finally:
            screen.kill()
            os.close(its_end)
            os.close(terminal)
