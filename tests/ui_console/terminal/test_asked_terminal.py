"""A screen is on standard output; its terminal is asked for a sign of life, unless a multiplexer would answer."""

from __future__ import annotations

import subprocess

import pytest
from examples import rest_thorough
from screen_on_a_terminal import screen_on_a_terminal

pytestmark = pytest.mark.processes

ASKED = b"\x1b[6n"
PROGRAM = """
from textual.widgets import Static
from ui_console.terminal.ending import EndingApp

class Screen(EndingApp):
    BINDINGS = [("w", "ask", "ask")]
    def compose(self):
        yield Static("BEGUN")
    def action_ask(self):
        self.ask_terminal()
        self.query_one(Static).update("NOW-WAITS")
    def on_cursor_position(self, event):
        self.query_one(Static).update(f"ANSWERED-{event.x}-{event.y}")

Screen().run()
"""


def test_an_answer_arrives_as_the_place_of_the_cursor() -> None:
    with screen_on_a_terminal(PROGRAM) as played:
        played.wait_shown(b"BEGUN")
        played.type(b"w")
        played.wait_shown(ASKED)
        played.type(b"\x1b[5;7R")
        played.wait_shown(b"ANSWERED-6-4")


@pytest.mark.parametrize("multiplexer", rest_thorough(["TMUX", "STY"]))
def test_a_multiplexer_is_not_asked(multiplexer: str) -> None:
    with screen_on_a_terminal(PROGRAM, {multiplexer: "one"}) as played:
        played.wait_shown(b"BEGUN")
        played.type(b"w")
        assert ASKED not in played.wait_shown(b"NOW-WAITS")


def test_a_screen_is_shown_where_standard_output_is() -> None:
    with screen_on_a_terminal(PROGRAM, errors_to=subprocess.DEVNULL) as played:
        played.wait_shown(b"BEGUN")
