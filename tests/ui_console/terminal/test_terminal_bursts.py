"""Every key of every screen, pressed twice before the screen answers: no console ends but by the keys that end it."""

from __future__ import annotations

import gc
import warnings

import numpy as np
import pytest
from bursts import EVERY_KEY, LEAVE, LOOKS, SIZES, burst, press_all_twice
from console_scenes import STOP, held_model
from examples import some
from screen_text import screen_text
from textual.app import App
from textual.pilot import Pilot
from written_session import WrittenSession, settle

from ui_console.model.events import Heard
from ui_console.model.profile import Profile
from ui_console.terminal import display
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.tables import PanelName

CONSOLE_SCREENS: dict[str, list[str]] = {
    "main": [],
    "bare": ["v"],
    "picker": ["p"],
    "why": ["y"],
    "keys": ["question_mark"],
    "reason": ["M"],
    "parameter": [*["tab"] * 6, "e"],
    "lift": ["c"],
    "search": ["slash"],
    "orders": ["O"],
    "order fields": ["O", "enter"],
}


NO_DIALOGS = ("main", "bare")
QUIET_S = 3.0


def console(profile: Profile = Profile.TERMINAL) -> ConsoleApp:
    shown = held_model()
    shown.apply(Heard(11.0, STOP))
    session = WrittenSession(shown=shown)
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    return ConsoleApp(session, profile=profile)


async def to_main(pilot: Pilot[None]) -> None:
    """Show everything again, with the first table chosen."""
    app = pilot.app
    assert isinstance(app, ConsoleApp)
    if app.screen.has_class("-bare"):
        await pilot.press("v")
    while app.profile is not Profile.PENDANT and app.chosen is not PanelName.ROBOTS:
        await pilot.press("tab")


def state_of(app: App[None]) -> object:
    """Return which screen is shown, and how."""
    assert isinstance(app, ConsoleApp)
    return app.screen, app.screen.has_class("-bare"), app.chosen


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the screen drawn by keys rather than by time, which takes what there is of a busy machine."""
    monkeypatch.setattr(display, "REDRAW_EVERY_S", QUIET_S)
    monkeypatch.setattr(display, "TABLES_EVERY_S", QUIET_S)
    monkeypatch.setattr(display, "MONITOR_EVERY_S", QUIET_S)


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize("name", some(name for name in CONSOLE_SCREENS if name not in NO_DIALOGS))
async def test_a_dialog_is_answered_once_however_fast_its_key_comes_twice(name: str) -> None:
    keys = ["enter", "escape", "space", "l", "q"]
    await press_all_twice(console(), (80, 24), CONSOLE_SCREENS[name], keys, to_main, state_of, is_dialog=True)


@pytest.mark.parametrize("key", ["y", "i"])
async def test_what_is_asked_for_twice_at_once_is_asked_for(key: str) -> None:
    app = console()
    async with app.run_test(size=(80, 24)) as pilot:
        with warnings.catch_warnings(record=True) as never_awaited:
            burst(pilot, key, key)
            await settle(pilot)
            gc.collect()
        assert not never_awaited


@pytest.mark.parametrize("profile", list(Profile))
async def test_without_colors_every_console_is_drawn(profile: Profile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    app = console(profile)
    async with app.run_test(size=(80, 24)) as pilot:
        await settle(pilot)
        assert "scout1" in screen_text(app)


async def test_a_dialog_may_be_looked_at_before_it_is_laid_out() -> None:
    app = console()
    async with app.run_test(size=(80, 24)) as pilot:
        for action in (app.action_pick, app.action_lift):
            action()
            app.redraw()
            await settle(pilot)
            assert len(app.screen_stack) == 2
            await pilot.press("escape")
            await settle(pilot)


@pytest.mark.parametrize("key", LEAVE)
async def test_keys_typed_ahead_of_the_end_are_not_heard(key: str) -> None:
    app = console()
    async with app.run_test(size=(80, 24)) as pilot:
        burst(pilot, key, key, "x", "p", "y", "M", "enter", key, "c")
        await pilot.pause()
    assert app.return_code == LEAVE[key]


async def test_a_key_that_arrives_together_with_the_escape_before_it_still_leaves() -> None:
    """A busy terminal hands over both at once, which reads as one key with alt."""
    app = console()
    async with app.run_test(size=(80, 24)) as pilot:
        burst(pilot, "alt+q")
        await settle(pilot)
    assert app.return_code == LEAVE["q"]


@pytest.mark.slow
@pytest.mark.usefixtures("quiet")
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", CONSOLE_SCREENS)
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(("theme", "is_colorless"), LOOKS)
async def test_every_key_of_the_console_may_come_twice(
    name: str, size: tuple[int, int], theme: str, is_colorless: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if is_colorless:
        monkeypatch.setenv("NO_COLOR", "1")
    app = console()
    app.theme = theme
    keys, is_dialog = [*EVERY_KEY, *LEAVE], name not in NO_DIALOGS
    await press_all_twice(app, size, CONSOLE_SCREENS[name], keys, to_main, state_of, is_dialog=is_dialog)


@pytest.mark.slow
@pytest.mark.usefixtures("quiet")
@pytest.mark.timeout(600)
@pytest.mark.parametrize("profile", [Profile.PENDANT, Profile.MONITOR])
@pytest.mark.parametrize("size", SIZES, ids=str)
async def test_every_key_of_a_pendant_and_a_monitor_may_come_twice(profile: Profile, size: tuple[int, int]) -> None:
    for opening in ([], ["question_mark"], ["c"]):
        keys, is_dialog = [*EVERY_KEY, *LEAVE], bool(opening)
        await press_all_twice(console(profile), size, opening, keys, to_main, state_of, is_dialog=is_dialog)
