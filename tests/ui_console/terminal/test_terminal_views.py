"""Debug views on the terminal console: chosen from a list, shown live, and left with escape."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from screen_text import screen_text
from textual.pilot import Pilot
from written_session import WrittenSession, settle

from backbone.debug_views import UnknownView, ViewEntry, ViewKind, ViewPicture, Views, ViewValue
from ui_console.model.profile import Profile
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.look_app import LookApp
from ui_console.terminal.widgets import Video

SIZE = (100, 36)
WATCHER = "mission_control/watch1"
VIEWS = {
    WATCHER: Views([ViewEntry("difference", ViewKind.PICTURE), ViewEntry("threshold", ViewKind.VALUE, 28.0)]),
    "mission_control/servo": Views([ViewEntry("phase", ViewKind.VALUE, "tracking")]),
}
PICTURE = ViewPicture("difference", 11.5, 4, 2, False, memoryview(bytes([255] * 8)))


async def drawn(pilot: Pilot[Any]) -> None:
    """Return when the look has begun and its first picture is drawn; the look itself goes on."""
    for _ in range(4):
        await pilot.pause()


@pytest.mark.parametrize("profile", [Profile.TERMINAL, Profile.MONITOR])
async def test_a_picture_is_chosen_from_the_list_and_seen_until_escape(profile: Profile) -> None:
    session = WrittenSession()
    session.views, session.seen = VIEWS, [PICTURE]
    async with ConsoleApp(session, profile=profile).run_test(size=SIZE) as pilot:
        await pilot.press("b")
        await settle(pilot)
        listed = screen_text(pilot.app)
        assert all(
            line in listed for line in ("watch1  difference", "watch1  threshold  28", "servo   phase  tracking")
        )
        await pilot.press("enter")
        await drawn(pilot)
        shown = screen_text(pilot.app)
        assert "watch1: difference" in shown
        assert "at 11.5 s" in shown
        assert "▀" * 20 in shown
        assert session.wanted == ["views", ("look", WATCHER, "difference")]
        await pilot.press("escape")
        await settle(pilot)
        assert len(pilot.app.screen_stack) == 1
        assert session.wanted[-1] == "looks no more"


@pytest.mark.parametrize(
    ("seen", "line"),
    [(ViewValue("threshold", 11.5, 28.25), "28.25  at 11.5 s"), (UnknownView("it ended"), "it ended")],
)
async def test_a_value_or_what_is_wrong_stands_below_the_picture(seen: ViewValue | UnknownView, line: str) -> None:
    session = WrittenSession()
    session.views, session.seen = VIEWS, [seen]
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("b")
        await settle(pilot)
        await pilot.press("down", "enter")
        await drawn(pilot)
        assert line in screen_text(pilot.app)


async def test_without_views_the_key_says_so() -> None:
    session = WrittenSession()
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("b")
        await settle(pilot)
        assert "no behavior shows anything yet" in screen_text(pilot.app)
        assert len(pilot.app.screen_stack) == 1


@pytest.mark.parametrize("key", ["q", "escape", "ctrl+c"])
async def test_the_screen_of_look_shows_a_picture_in_color_and_is_left_by_a_key(key: str) -> None:
    picture = np.full((30, 40, 3), (255, 0, 0), np.uint8)
    app = LookApp(lambda: picture, lambda: "watch1: skeleton [0.1 s old]")
    async with app.run_test(size=(40, 16)) as pilot:
        await drawn(pilot)
        assert "watch1: skeleton [0.1 s old]" in screen_text(app)
        [segment, *_] = pilot.app.query_one(Video).render_line(2)
        assert segment.style is not None
        assert segment.style.color is not None
        assert segment.style.color.number == 196
        await pilot.press(key)
        await pilot.pause()
        assert not app.is_running
    assert app.return_code == 0
