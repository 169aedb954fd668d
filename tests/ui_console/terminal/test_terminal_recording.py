"""A recording on the terminal console: played, and moved by keys and mouse; why of each time; nothing commanded."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import pytest
from examples import some
from screen_text import screen_text
from small_recordings import SCOUT, Said, recorded
from textual.binding import Binding
from textual.pilot import Pilot
from textual.widgets import DataTable

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.clock import VirtualClock
from backbone.component.messages import ComponentState, LifeState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.presence import Presence
from backbone.scheduling.requests import Holder
from backbone.scheduling.views import RcView, Schedule
from resource_pool.arc_client import Frame
from ui_console.model.key_table import KeyRow, KeyTable
from ui_console.session.recorded_play import NOT_NOW
from ui_console.terminal.dialogs import Field
from ui_console.terminal.keys import KEYS
from ui_console.terminal.recorded_app import RecordedApp
from ui_console.terminal.recorded_keys import PLAYS, refused_keys
from ui_console.terminal.recorded_session import RecordedSession

SIZE = (120, 40)
ARC = "watch-capture"
FIRST_S, LAST_S, EACH_S = 1.0, 60.0, 5.0


def state(address: str, kind: str, doing: str = "") -> ComponentState:
    return ComponentState(address, kind, "base", 7, LifeState.READY, 0.5, doing, is_robot=kind == "scout")


def in_round(number: int) -> list[Said]:
    at_s = 2.0 + EACH_S * number
    rc = RcView("scout1", "scout", "up", False, 1.0, [Holder(ARC, number + 1, at_s, 0.0)], 1, [], [], is_robot=True)
    arc = f"resource_pool/{ARC}"
    said = StoryEvent(at_s, SCOUT, f"round {number}", "scout1", "", LogLevel.INFO)
    frame = Frame("grabber", ARC, number + 1, "scout1", number, at_s, 4, 2, bytes([number * 10]) * 8)
    return [
        Said(at_s, SCOUT, Conversation.STATUS, state(SCOUT, "scout", f"round {number}")),
        Said(at_s, RC_MANAGER, Conversation.SCHEDULE, Schedule(at_s, [rc], [], []), RC_MANAGER),
        Said(at_s, arc, Conversation.FRAMES, frame, arc),
        Said(at_s, SCOUT, Conversation.LOG, said),
    ]


def a_minute() -> list[Said]:
    """Return a mission in which a robot says each five seconds how often it did, and twice that it fell."""
    begin = [Said(FIRST_S, at, Conversation.ALIVE, Presence(True), "") for at in (NAMESERVER, RC_MANAGER, SCOUT)]
    falls = [
        Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, "fell over", "scout1", "", LogLevel.ALARM))
        for at_s in (40.0, LAST_S)
    ]
    manager = Said(1.1, RC_MANAGER, Conversation.STATUS, state(RC_MANAGER, "rc_manager"), RC_MANAGER)
    told = [one for number in range(12) for one in in_round(number)]
    return sorted([*begin, manager, *told, *falls], key=lambda one: one.at_s)


FILE = recorded(a_minute()).getvalue()


def session() -> RecordedSession:
    return RecordedSession(lambda: io.BytesIO(FILE), VirtualClock(), "anna")


async def arrived(shown: RecordedSession, pilot: Pilot[Any]) -> str:
    """Return the screen once it shows the time that was gone to."""
    await shown.play.wait_arrived()
    await pilot.pause(1.2)
    return screen_text(pilot.app)


async def test_it_is_played_and_stands_still_and_steps() -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        playback = shown.play.playback
        assert "‖ 1 ×  1.0 s of 60.0 s: recording of night" in await arrived(shown, pilot)
        await pilot.press("plus", "space")
        await pilot.pause(5.0)
        await pilot.press("space")
        assert 10.0 < playback.now_s() < 13.0
        assert not playback.is_playing
        await pilot.press("tab", "tab", "tab", "tab")  # from the timeline to the components
        assert "round 1" in await arrived(shown, pilot)
        await pilot.press("full_stop")
        assert playback.now_s() == 12.0
        await pilot.press("q")

    await shown.run(pilot=at_the_keys, size=SIZE)


@pytest.mark.thorough
async def test_keys_and_mouse_go_to_any_time_and_the_screen_is_of_that_time() -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        playback = shown.play.playback
        await arrived(shown, pilot)
        await pilot.press("end")
        assert playback.now_s() == LAST_S
        await pilot.press("tab", "tab", "tab", "tab")
        screen = await arrived(shown, pilot)
        assert "round 11" in screen
        await pilot.press("left")
        assert playback.now_s() == LAST_S - 5.0
        await pilot.press("N")
        assert playback.now_s() == 40.0
        screen = await arrived(shown, pilot)
        assert "! 40.0 s  scout1: fell over" in screen
        assert "round 11" not in screen
        await pilot.press("n")
        assert playback.now_s() == LAST_S
        await pilot.click("#time-bar", offset=(1, 0))
        assert playback.now_s() == FIRST_S
        await arrived(shown, pilot)
        await pilot.press("g", *"33.5", "enter")
        await pilot.pause()
        assert playback.now_s() == 33.5
        await arrived(shown, pilot)
        await pilot.press("m", "down", "enter")
        await pilot.pause()
        assert playback.now_s() == LAST_S
        await pilot.press("q")

    await shown.run(pilot=at_the_keys, size=SIZE)


async def test_why_is_of_the_time_that_is_shown_even_if_it_is_asked_at_once() -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        await arrived(shown, pilot)
        shown.play.go_to(20.0)
        assert any("round 3" in line for line in await shown.why("scout1"))
        shown.play.go_to(8.0)
        await arrived(shown, pilot)
        await pilot.press("shift+tab", "shift+tab", "shift+tab", "y")  # from the timeline to the robots
        await pilot.pause(1.0)
        assert "why scout1?" in screen_text(pilot.app)
        assert "round 1" in screen_text(pilot.app)
        await pilot.press("escape", "q")

    await shown.run(pilot=at_the_keys, size=SIZE)


async def test_what_was_said_is_listed_and_one_key_is_shown_with_its_past() -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        await arrived(shown, pilot)
        shown.play.go_to(38.0)
        await arrived(shown, pilot)
        await pilot.press("B")
        await pilot.pause(2.0)
        listed = screen_text(pilot.app)
        assert "resource_pool/watch-capture/frames" in listed
        assert "backbone/rc_manager/alive" in listed, "also what is not said now"
        table = pilot.app.screen.query_one(DataTable)
        rows = [table.get_row_at(number)[0].plain for number in range(table.row_count)]
        await pilot.press(*["down"] * rows.index("backbone/rc_manager/schedule"), "enter")
        await pilot.pause(2.0)
        assert "Schedule/1: 8 messages, the last 1.0 s ago" in screen_text(pilot.app)
        assert "at_s: 2 to 37 in the last 60 s" in screen_text(pilot.app)
        await pilot.press("escape", "q")

    await shown.run(pilot=at_the_keys, size=SIZE)


@pytest.mark.thorough
async def test_a_picture_follows_the_time_also_back() -> None:
    shown = session()
    frames = next(row for row in rows_of(shown) if row.schema == "Frame/1")

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        app = pilot.app
        assert isinstance(app, RecordedApp)
        await arrived(shown, pilot)
        app.push_screen(app._key_dialog(frames))  # noqa: SLF001  what enter in the list opens
        for at_s, number in ((33.0, 6), (12.5, 2)):
            shown.play.go_to(at_s)
            await arrived(shown, pilot)
            fields = " ".join(screen_text(app).split())
            assert f"number {number}" in fields
            assert "▀▀▀▀" in fields
        await pilot.press("space")  # plays behind the dialog
        await pilot.pause(5.0)
        assert "number 3" in " ".join(screen_text(app).split())
        await pilot.press("space", "escape", "q")

    await shown.run(pilot=at_the_keys, size=SIZE)


def rows_of(shown: RecordedSession) -> list[KeyRow]:
    counts = shown.play.reopened().contents().counts
    return KeyTable(0.0, [(one.key, one.source, one.schema) for one in counts]).rows(0.0)


@pytest.mark.parametrize("key", some(["x", "X", "c", "t", "w", "up", "r", "p", "1", "o", "O", "e"]))
async def test_a_key_that_would_command_says_why_it_does_not(key: str) -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        await arrived(shown, pilot)
        await pilot.press(key)
        await pilot.pause()
        assert [note.message for note in pilot.app._notifications] == [NOT_NOW]  # noqa: SLF001
        assert len(pilot.app.screen_stack) == 1
        await pilot.press("q")

    await shown.run(pilot=at_the_keys, size=SIZE)


@pytest.mark.parametrize("opens", ["slash", "g", "B"])
async def test_a_field_takes_every_letter_for_nothing_can_be_stopped(opens: str) -> None:
    shown = session()

    async def at_the_keys(pilot: Pilot[Any]) -> None:
        await arrived(shown, pilot)
        await pilot.press(opens)
        await pilot.pause(2.0)
        field = pilot.app.screen.query_one(Field)
        field.value = ""
        await pilot.press(*"xXn")
        await pilot.pause()
        assert field.value == "xXn"
        assert "stop robots" not in screen_text(pilot.app)
        assert not pilot.app._notifications  # noqa: SLF001
        await pilot.press("escape", "q")

    await shown.run(pilot=at_the_keys, size=SIZE)


def test_every_key_of_the_console_plays_looks_or_says_why_not() -> None:
    shown = session()
    app = RecordedApp(shown, shown.play, shown.time_line)
    known = set(app._bindings.key_to_bindings)  # noqa: SLF001
    silent = {"v", "enter", "escape"}
    assert {one.key for one in Binding.make_bindings(KEYS)} - known == silent
    assert {"x", "X", "c", "w", "t", "r", "O"} <= {one.key for one in refused_keys()}


def test_the_reference_names_every_key_that_plays() -> None:
    page = (Path(__file__).parents[3] / "docs/reference/console-keys.md").read_text()
    rows = re.findall(r"^\| ((?:`[^`]+` ?)+)\|[^|]*\|$", page, re.MULTILINE)
    listed = [key for keys in rows for key in re.findall(r"`([^`]+)`", keys)]
    assert listed == [one.key for one in Binding.make_bindings(PLAYS)]
