"""A screen whose process was stopped and continued by signals still reads its keys, and ends."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.processes

PROGRAM = """
import threading
from textual.widgets import Static
from ui_console.terminal.ending import EndingApp

class Screen(EndingApp):
    BINDINGS = [("q", "quit", "end"), ("w", "drive", "drive")]
    def compose(self):
        yield Static("BEGUN")
    def action_drive(self):
        readers = [one for one in threading.enumerate() if one.name == "textual-input"]
        self.query_one(Static).update(f"READ-BY-{len(readers)}")

Screen().run()
"""
WITHIN_S = 10.0


def wait_shown(terminal: int, what: bytes) -> None:
    """Return when the words are on the terminal."""
    shown, deadline = b"", time.monotonic() + WITHIN_S
    while what not in shown:
        assert time.monotonic() < deadline, shown
        if select.select([terminal], [], [], 1.0)[0]:
            shown += os.read(terminal, 1 << 16)


@pytest.mark.parametrize("stop", [signal.SIGSTOP, signal.SIGTSTP])
def test_a_screen_that_was_stopped_and_continued_reads_keys_and_ends(stop: signal.Signals) -> None:
    terminal, its_end = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "TERM": "xterm-256color"},
        stdin=its_end,
        stdout=its_end,
        stderr=its_end,
        start_new_session=True,
    ) as screen:
        try:
            wait_shown(terminal, b"BEGUN")
            screen.send_signal(stop)
            os.waitid(os.P_PID, screen.pid, os.WSTOPPED | os.WNOWAIT)
            screen.send_signal(signal.SIGCONT)
            wait_shown(terminal, b"BEGUN")  # drawn again, because a shell may have written over it
            os.write(terminal, b"w")
            wait_shown(terminal, b"READ-BY-1")  # of two readers, one waits for ever
            os.write(terminal, b"q")
            wait_shown(terminal, b"\x1b[?1049l")  # the terminal's first screen
            assert screen.wait(WITHIN_S) == 0
        finally:
            screen.kill()
            os.close(its_end)
            os.close(terminal)
