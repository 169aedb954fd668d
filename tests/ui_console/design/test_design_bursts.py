"""Every key of every screen of the designer, pressed twice before it answers; and no key that leaves loses work."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from bursts import EVERY_KEY, LEAVE, LOOKS, SIZES, answered, burst, press_all_twice
from design_keys import known
from screen_text import screen_text
from textual.pilot import Pilot
from textual.widgets import Input

from ui_console.design.dialogs import Sure
from ui_console.design.draft import Draft
from ui_console.design.screen import DesignApp, PanelName

DESIGN_SCREENS: dict[str, list[str]] = {
    "main": [],
    "properties": ["tab"],
    "problems": ["tab", "tab"],
    "picker": ["a"],
    "ask": ["n"],
    "catalogue": ["c"],
    "text": ["t"],
    "keys": ["question_mark"],
    "save as": ["w"],
    "sure": ["plus", "q"],
}


NO_DIALOGS = ("main", "properties", "problems")


def designer(folder: Path) -> DesignApp:
    return DesignApp(Draft.new(str(folder / "guard.xml")), known)


def back_to(clean: Draft) -> Callable[[Pilot[None]], Awaitable[None]]:
    """Return what undoes all that was done to the draft and goes to its root."""

    async def to_main(pilot: Pilot[None]) -> None:
        app = pilot.app
        assert isinstance(app, DesignApp)
        app.draft = clean
        app.go_to(())
        while app.chosen is not PanelName.TREE:
            await pilot.press("tab")

    return to_main


@pytest.mark.parametrize("name", [name for name in DESIGN_SCREENS if name not in NO_DIALOGS])
@pytest.mark.parametrize("key", ["enter", "escape", "n"])
async def test_a_dialog_of_the_designer_is_answered_once(name: str, key: str, tmp_path: Path) -> None:
    app = designer(tmp_path)
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        await pilot.press(*DESIGN_SCREENS[name])
        await answered(pilot)
        burst(pilot, key, key)
        await answered(pilot)
        assert app.is_running


async def test_what_is_not_saved_is_not_left_unasked_by_any_key_that_leaves(tmp_path: Path) -> None:
    for key in LEAVE:
        app = designer(tmp_path)
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.press("plus", key)
            await answered(pilot)
            assert app.is_running, key
            assert "not saved. Leave?" in screen_text(app)


async def test_leaving_a_field_of_the_designer_asks_once(tmp_path: Path) -> None:
    app = designer(tmp_path)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("plus", "n")
        await answered(pilot)
        assert app.screen.query(Input)
        burst(pilot, "ctrl+c", "ctrl+c")
        await answered(pilot)
        assert "not saved. Leave?" in screen_text(app)
        assert len(app.screen_stack) == 3


@pytest.mark.parametrize("keys", [["enter", "enter", "q", "y"], ["a", "a", "c", "w"], ["enter", "enter", "enter", "n"]])
async def test_no_dialog_opens_over_another_however_fast_their_keys_come(keys: list[str], tmp_path: Path) -> None:
    app = designer(tmp_path)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("plus", "tab")
        burst(pilot, *keys)
        await answered(pilot)
        assert len([screen for screen in app.screen_stack if not isinstance(screen, Sure)]) <= 2


async def test_keys_typed_ahead_of_the_end_are_not_heard(tmp_path: Path) -> None:
    app = designer(tmp_path)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.press("s")
        await answered(pilot)
        burst(pilot, "q", "q", "a", "n", "enter", "ctrl+c", "y")
        await answered(pilot)
    assert app.return_code == 0


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", DESIGN_SCREENS)
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(("theme", "is_colorless"), LOOKS)
async def test_every_key_of_the_designer_may_come_twice(
    name: str, size: tuple[int, int], theme: str, is_colorless: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if is_colorless:
        monkeypatch.setenv("NO_COLOR", "1")
    app = designer(tmp_path)
    app.theme = theme
    await press_all_twice(
        app, size, DESIGN_SCREENS[name], EVERY_KEY, back_to(app.draft), is_dialog=name not in NO_DIALOGS
    )
