"""A screen continues after any input of its terminal, and only keys act as keys."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from textual.app import App
from textual.events import Key
from textual.message import Message

from ui_console.terminal.driver import TerminalDriver
from ui_console.terminal.ending import EndingApp

END = b"q"


class ReadKeys(TerminalDriver):
    """Collects the keys until the key of the end."""

    def __init__(self, app: App[None]) -> None:
        super().__init__(app)
        self.keys: list[str] = []

    def process_message(self, message: Message) -> None:
        if isinstance(message, Key):
            self.keys.append(message.key)
            if message.key == END.decode():
                self.exit_event.set()


@pytest.fixture(autouse=True)
def _signals_stay() -> Iterator[None]:
    """Restore the signals that a driver handles."""
    before = {one: signal.getsignal(one) for one in (signal.SIGTSTP, signal.SIGCONT)}
    yield
    for one, handler in before.items():
        signal.signal(one, handler)


async def keys_of(*typed: bytes) -> list[str]:
    """Return the keys that a console reads from these bytes."""
    screen: EndingApp = EndingApp()
    assert screen.driver_class is TerminalDriver
    driver = ReadKeys(screen)
    driver.fileno, ours = os.pipe()
    os.write(ours, b"".join(typed) + END)
    driver.run_input_thread()
    os.close(ours)
    os.close(driver.fileno)
    return driver.keys[:-1]


@pytest.mark.parametrize("strange", [b"\xe4", b"\xff\xfe", b"\xc3", b"\x80"])
async def test_bytes_that_are_no_text_end_no_screen_and_cost_no_stop(strange: bytes) -> None:
    assert [key for key in await keys_of(strange, b"X", strange, b"w") if key in "Xw"] == ["X", "w"]


@pytest.mark.parametrize("strange", [b"\x1b[9999999999u", b"\x1b[1114112u", b"\x1b[97:65;1u", b"\x1b[1;1:3A"])
async def test_a_number_that_no_key_has_ends_no_screen(strange: bytes) -> None:
    assert await keys_of(b"w", strange) == ["w"]


async def test_text_of_any_language_is_read_as_typed() -> None:
    assert await keys_of("ä€".encode()) == ["ä", "euro_sign"]


UNKNOWN = [b"\x1bO2x", b"\x1bO5r", b"\x1b[2^", b"\x1b[5$", b"\x1b[1;5Z", b"\x1b[?997;1n"]
"""Keypad of xterm with shift and control, Insert and PageUp of rxvt, tab of mintty, a report of the light theme."""


@pytest.mark.parametrize("sequence", UNKNOWN)
async def test_a_key_that_is_not_known_takes_no_robot_and_stops_none(sequence: bytes) -> None:
    assert await keys_of(sequence, b"\x1b[A", b"X") == ["up", "X"]


async def test_a_stop_right_after_an_unknown_key_is_a_stop() -> None:
    assert (await keys_of(b"\x1bO2rX", b"\x1b[A"))[-2:] == ["X", "up"]


async def test_keys_typed_fast_after_escape_are_keys() -> None:
    assert await keys_of(b"\x1bxr", b"\x1b[A") == ["alt+x", "r", "up"]
