"""A terminal that does not read holds up neither a screen nor its end, and has the newest screen later."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator

import pytest
from screen_on_a_terminal import WITHIN_S, screen_on_a_terminal

from backbone.command_line.terminal_output import BEHIND_S
from backbone.component.own_tasks import TASKS_END_WITHIN_S
from ui_console.terminal.driver import ENDS_WITHIN_S

PROGRAM = """
import asyncio, os, signal
from textual.widgets import Static
from ui_console.terminal.ending import EndingApp

class Screen(EndingApp):
    BINDINGS = [("w", "write", "write")]
    drawn = 0
    def compose(self):
        yield Static("BEGUN")
        yield Static("", id="many")
    def on_mount(self):
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, self.exit)
        self.set_interval(0.02, self.draw)
    def draw(self):
        self.drawn += 1
        self.query_one("#many").update(f"{self.drawn:<5}" * 300)
    def action_write(self):
        self.query_one(Static).update("WRITTEN")
        os.write(MARK, b"1")

MARK = int(os.environ["MARK"])
Screen().run()
"""


@pytest.fixture
def mark() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    os.set_inheritable(ends[1], True)
    yield ends
    for end in ends:
        os.close(end)


@pytest.mark.processes
def test_a_screen_that_nobody_reads_takes_keys_and_ends(mark: tuple[int, int]) -> None:
    with screen_on_a_terminal(PROGRAM, {"MARK": str(mark[1])}) as played:
        played.wait_shown(b"BEGUN")
        time.sleep(2 * BEHIND_S)  # in which nobody reads
        played.type(b"w")
        assert os.read(mark[0], 1) == b"1"
        played.screen.send_signal(signal.SIGTERM)
        assert played.screen.wait(WITHIN_S) == 0


@pytest.mark.processes
def test_a_terminal_that_reads_again_gets_what_it_missed(mark: tuple[int, int]) -> None:
    with screen_on_a_terminal(PROGRAM, {"MARK": str(mark[1])}) as played:
        played.wait_shown(b"BEGUN")
        time.sleep(2 * BEHIND_S)
        played.type(b"w")
        assert os.read(mark[0], 1) == b"1"
        played.wait_shown(b"WRITTEN")


def test_the_end_of_a_screen_holds_up_no_end_of_the_console() -> None:
    assert ENDS_WITHIN_S[0] < TASKS_END_WITHIN_S / 2
