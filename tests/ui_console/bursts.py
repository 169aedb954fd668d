"""Keys pressed faster than a screen answers, every one of them on every screen."""

from __future__ import annotations

import itertools
import string
import time
import unicodedata
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from textual.app import App
from textual.events import Key
from textual.pilot import Pilot

SIZES = [(80, 24), (120, 40), (200, 60)]
LOOKS = list(itertools.product(["textual-dark", "textual-light"], [False, True]))
"""Theme, and whether ``NO_COLOR`` is set."""
SETTLES_WITHIN_S = 60.0  # a machine that also runs other tests draws a screen in seconds
LEAVE = {"q": 0, "ctrl+q": 0, "ctrl+c": 130}
NAMED_KEYS = [
    *("enter", "escape", "space", "tab", "shift+tab", "backspace", "delete", "home", "end", "insert"),
    *("up", "down", "left", "right", "shift+up", "shift+down", "shift+left", "shift+right", "pageup", "pagedown"),
    *("plus", "minus", "equals_sign", "question_mark", "left_square_bracket", "right_square_bracket"),
    *("less_than_sign", "greater_than_sign", "full_stop", "slash", "alt+x", "alt+shift+x", "f1", "f2"),
    *("ctrl+a", "ctrl+d", "ctrl+k", "ctrl+u", "ctrl+v", "ctrl+w", "ctrl+x", "ctrl+y", "ctrl+z"),
]
EVERY_KEY = [*string.ascii_letters, *string.digits, *NAMED_KEYS]
CHARACTERS = {
    "enter": "\r",
    "escape": "\x1b",
    "backspace": "\x7f",
    "tab": "\t",
    "minus": "-",
    "plus": "+",
}
"""Of keys whose name is no Unicode name."""


async def answered(pilot: Pilot[Any]) -> None:
    """Return when the screen has taken in what was pressed; a dialog may be open then."""
    for _ in range(3):
        await pilot.pause()


def burst(pilot: Pilot[Any], *keys: str) -> None:
    """Press keys before the screen has answered the first of them."""
    for key in keys:
        pilot.app.post_message(Key(key, _character(key)))


def _character(key: str) -> str | None:
    if len(key) == 1 or key in CHARACTERS:
        return CHARACTERS.get(key, key)
    try:
        return unicodedata.lookup(key.replace("_", " ").upper())
    except KeyError:
        return None


async def press_all_twice(
    app: App[None],
    size: tuple[int, int],
    opening: Sequence[str],
    keys: Sequence[str],
    to_main: Callable[[Pilot[None]], Awaitable[None]],
    state_of: Callable[[App[None]], object],
    *,
    is_dialog: bool,
) -> None:
    """Press each key twice at once on one screen; only the keys that leave may end it, and only in good order.

    Args:
        app: The program.
        size: Columns and lines.
        opening: Keys that bring the screen up from the main one.
        keys: To be tried.
        to_main: Goes back to the main screen as it was, once dialogs are closed.
        state_of: Returns what a key may change; where it did, the screen is opened anew for the next key.
        is_dialog: Whether the screen is one.
    """
    ending = [key for key in keys if key in LEAVE]
    async with app.run_test(size=size, notifications=True) as pilot:
        opened: object = None
        for key in [*(key for key in keys if key not in LEAVE), *ending]:
            if state_of(app) != opened:
                await _open(pilot, opening, to_main, is_dialog=is_dialog)
                opened = state_of(app)
            burst(pilot, key, key)
            await (pilot.pause() if is_dialog or key in LEAVE else answered(pilot))
            if not app.is_running:
                assert key in LEAVE, f"{key} twice ended the screen"
                break
            assert app.return_code is None, f"{key} twice ended the screen"
    assert app.return_code in (None, *LEAVE.values())


async def _open(
    pilot: Pilot[None],
    opening: Sequence[str],
    to_main: Callable[[Pilot[None]], Awaitable[None]],
    *,
    is_dialog: bool,
) -> None:
    """Open a screen from the main one by these keys."""
    await answered(pilot)
    await _close_dialogs(pilot)
    await to_main(pilot)
    if opening:
        await pilot.press(*opening)
    await until(pilot, lambda: len(pilot.app.screen_stack) == 1 + is_dialog, "the screen that the keys open is there")


async def until(pilot: Pilot[Any], is_so: Callable[[], bool], what: str) -> None:
    """Return when it is so.

    Raises:
        AssertionError: It did not become so in time.
    """
    deadline_s = time.monotonic() + SETTLES_WITHIN_S
    while not is_so():
        assert time.monotonic() < deadline_s, what
        await pilot.pause(0.01)


async def _close_dialogs(pilot: Pilot[None]) -> None:
    while len(pilot.app.screen_stack) > 1:
        closing = pilot.app.screen
        await pilot.press("escape")
        await until(pilot, lambda: pilot.app.screen is not closing, f"escape closes {closing}")  # noqa: B023
