"""What is said on the terminal console: keys in a list with their rates, and the messages of one."""

from __future__ import annotations

import base64

import pytest
from screen_text import screen_text
from textual.app import App
from textual.widgets import DataTable, Sparkline
from written_session import WrittenSession, settle

from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import installed_views
from ui_console.model.profile import Profile
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.key_dialogs import KeyDialog, KeyPicker

SIZE = (110, 36)
SCOUT = "resource_pool/scout1"
READINGS = KeyRow(f"{SCOUT}/readings", SCOUT, "Readings/1", 10.0, 640.0, 64.0, 11.9)
COMMAND = KeyRow(f"{SCOUT}/command", "resource_pool/drive1", "Drive/1", 20.0, 800.0, 40.0, 11.9)
FRAMES = KeyRow("resource_pool/watch/frames", "resource_pool/watch", "Frame/1", 15.0, 1.2e6, 76843.0, 11.9)


def words(app: App[None]) -> str:
    return " ".join(screen_text(app).split())


def readings() -> KeyView:
    view = KeyView("Readings/1", installed_views())
    for number in range(21):
        view.take({"battery": {"share": 1.0 - number / 40}, "gait": "[b]trot"}, 10.0 + number / 10, number)
    return view


@pytest.mark.parametrize("profile", [Profile.TERMINAL, Profile.MONITOR])
async def test_a_key_is_chosen_from_the_list_and_its_numbers_are_plotted_until_escape(profile: Profile) -> None:
    session = WrittenSession()
    session.listed, session.heard = [[READINGS]], readings()
    async with ConsoleApp(session, profile=profile).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        assert f"{READINGS.key} 10.00 640 64 Readings/1" in words(pilot.app)
        await pilot.press("enter")
        await pilot.pause(0.5)
        shown = screen_text(pilot.app)
        assert "Readings/1: 21 messages, the last 0.0 s ago" in shown
        assert "battery.share  0.5" in shown
        assert "gait           [b]trot" in shown
        assert "battery.share: 0.5 to 1 in the last 60 s" in shown
        plot = pilot.app.screen.query_one(Sparkline)
        assert plot.data is not None
        assert len(plot.data) == plot.size.width
        assert plot.data[0] > 0.9
        assert plot.data[-1] < 0.6
        await pilot.press("escape")
        await settle(pilot)
        assert len(pilot.app.screen_stack) == 1
        assert session.wanted == ["list", "lists no more", ("hear", *READINGS.id), "hears no more"]


async def test_the_cursor_stays_on_its_key_while_others_come_and_go() -> None:
    session = WrittenSession()
    session.listed = [[READINGS], [COMMAND, FRAMES, READINGS], [COMMAND, READINGS]]
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        for lines in (1, 3, 2):
            await pilot.pause(0.5)
            table = pilot.app.screen.query_one(DataTable)
            assert table.row_count == lines
            assert table.get_row_at(table.cursor_row)[0].plain == READINGS.key
            await pilot.pause(0.5)
        assert f"{COMMAND.key} 20.00 800 40 Drive/1 {COMMAND.source}" in words(pilot.app)


async def test_words_narrow_the_list() -> None:
    session = WrittenSession()
    session.listed = [[COMMAND, FRAMES, READINGS]]
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        await pilot.press(*"scout1 drive")
        await pilot.pause()
        assert "1 of 3 rows" in screen_text(pilot.app)
        await pilot.press("enter")
        await pilot.pause()
        assert session.wanted[-1] == ("hear", *COMMAND.id)


async def test_without_a_row_enter_chooses_nothing() -> None:
    session = WrittenSession()
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        await pilot.press("down", "enter")
        await pilot.pause()
        assert isinstance(pilot.app.screen, KeyPicker)
        assert session.wanted == ["list"]


@pytest.mark.thorough
async def test_the_field_under_the_cursor_is_plotted_and_a_text_is_not() -> None:
    session = WrittenSession()
    session.listed, session.heard = [[READINGS]], readings()
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        await pilot.press("enter")
        await pilot.pause(0.5)
        await pilot.press("down")
        await pilot.pause()
        assert "in the last 60 s" not in screen_text(pilot.app)
        await pilot.press("up")
        await pilot.pause()
        assert "in the last 60 s" in screen_text(pilot.app)


async def test_a_picture_is_shown_as_a_picture() -> None:
    session = WrittenSession()
    session.listed, session.heard = [[FRAMES]], KeyView("Frame/1", installed_views())
    pixels = base64.b64encode(bytes([255] * 8)).decode()
    session.heard.take({"robot": "scout1", "width_px": 4, "height_px": 2, "pixels": pixels}, 11.0, 1)
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        await pilot.press("enter")
        await pilot.pause(0.5)
        shown = screen_text(pilot.app)
        assert "▀" * 10 in shown
        assert "robot      scout1" in shown


async def test_a_stop_goes_through_the_list_and_the_view() -> None:
    session = WrittenSession()
    session.listed = [[READINGS]]
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("B")
        await pilot.pause()
        assert isinstance(pilot.app.screen, KeyPicker)
        await pilot.press("X", "enter")
        await pilot.pause()
        assert isinstance(pilot.app.screen, KeyDialog)
        await pilot.press("X")
        await pilot.pause()
        assert session.wanted.count("stop all") == 2
