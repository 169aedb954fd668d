"""A screen reads its keys and ends after a stop by signals, and after a paste without an end."""

from __future__ import annotations

import os
import select
import signal
import time

import pytest
from examples import rest_thorough
from screen_on_a_terminal import WITHIN_S, screen_on_a_terminal

from ui_console.terminal.key_gate import UNREAD_S

pytestmark = pytest.mark.processes

PROGRAM = """
import threading
from textual.widgets import Static
from ui_console.terminal.ending import EndingApp

class Screen(EndingApp):
    BINDINGS = [("q", "quit", "end"), ("w", "drive", "drive"), ("x", "stop", "stop")]
    def compose(self):
        yield Static("BEGUN")
    def action_drive(self):
        readers = [one for one in threading.enumerate() if one.name == "textual-input"]
        self.query_one(Static).update(f"READ-BY-{len(readers)}")
    def action_stop(self):
        self.query_one(Static).update("EMERGENCY")

Screen().run()
"""


READS_LATE = """
import time
from ui_console.terminal.driver import TerminalDriver

read = TerminalDriver.run_input_thread
TerminalDriver.run_input_thread = lambda self: (time.sleep(0.3), read(self))
"""


CONTINUED_IN_A_THREAD = """
import signal, threading

def take():
    signal.sigwait([signal.SIGUSR1])
    signal.pthread_kill(threading.get_ident(), signal.SIGCONT)

signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
threading.Thread(target=take, daemon=True).start()
"""
QUIET_S = 0.5  # the event loop waits then


@pytest.mark.parametrize("before", ["", READS_LATE], ids=["", "before it reads"])
@pytest.mark.parametrize("stop", rest_thorough([signal.SIGSTOP, signal.SIGTSTP]))
def test_a_screen_that_was_stopped_and_continued_reads_keys_and_ends(stop: signal.Signals, before: str) -> None:
    with screen_on_a_terminal(before + PROGRAM) as played:
        played.wait_shown(b"BEGUN")
        played.screen.send_signal(stop)
        os.waitid(os.P_PID, played.screen.pid, os.WSTOPPED | os.WNOWAIT)
        played.screen.send_signal(signal.SIGCONT)
        played.wait_shown(b"BEGUN")  # drawn again, because a shell may have written over it
        played.type(b"w")
        played.wait_shown(b"READ-BY-1")  # of two readers, one waits for ever
        played.type(b"q")
        played.wait_shown(b"\x1b[?1049l")  # the terminal's first screen
        assert played.screen.wait(WITHIN_S) == 0


@pytest.mark.parametrize("continued_by", [signal.SIGCONT, signal.SIGUSR1], ids=["", "in another thread"])
def test_a_screen_in_which_nothing_changes_is_drawn_again(continued_by: signal.Signals) -> None:
    with screen_on_a_terminal(CONTINUED_IN_A_THREAD + PROGRAM) as played:
        played.wait_shown(b"BEGUN")
        while select.select([played.terminal], [], [], QUIET_S)[0]:
            os.read(played.terminal, 1 << 16)
        played.screen.send_signal(continued_by)
        played.wait_shown(b"BEGUN")


@pytest.mark.parametrize("stop", rest_thorough([signal.SIGTSTP, signal.SIGSTOP]))
def test_keys_typed_while_a_screen_was_stopped_are_dropped_but_not_the_emergency_stop(stop: signal.Signals) -> None:
    with screen_on_a_terminal(PROGRAM) as played:
        played.wait_shown(b"BEGUN")
        played.screen.send_signal(stop)
        os.waitid(os.P_PID, played.screen.pid, os.WSTOPPED | os.WNOWAIT)
        played.type(b"xw\x1bOP\x1b[200~w\x1b[201~")
        time.sleep(2 * UNREAD_S)
        played.screen.send_signal(signal.SIGCONT)
        shown = played.wait_shown(b"EMERGENCY")
        shown += b"" if b"dropped" in shown else played.wait_shown(b"dropped")
        assert b"READ-BY" not in shown
        played.type(b"w")
        played.wait_shown(b"READ-BY-1")


def test_a_paste_without_an_end_takes_no_stop_and_no_end() -> None:
    with screen_on_a_terminal(PROGRAM) as played:
        played.wait_shown(b"BEGUN")
        played.type(b"\x1b[200~w")
        shown, deadline = b"", time.monotonic() + WITHIN_S
        while b"EMERGENCY" not in shown:
            assert time.monotonic() < deadline, shown
            played.type(b"x")  # a hand presses again, because a busy machine may read paste and key at once
            if select.select([played.terminal], [], [], 0.2)[0]:
                shown += os.read(played.terminal, 1 << 16)
        assert b"READ-BY" not in shown
        played.type(b"q")
        assert played.screen.wait(WITHIN_S) == 0
