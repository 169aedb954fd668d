"""Tables and dialogs of the terminal console."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable

import msgspec
import pytest
from console_scenes import ASK, GRANT, SCHEDULE, STOP, TEAM_EVENTS, held_model, model, rc
from pressed_keys import FORWARD, SIZE
from screen_text import screen_text
from textual.events import Key
from textual.message import Message
from textual.widgets import Input
from written_session import WrittenSession, settle

from backbone.component.messages import StoryEvent
from backbone.errors import Refusal
from backbone.mission_log.log import AskLog, Log
from ui_console.model.consent import Consent, Settled, Sought, Topic
from ui_console.model.events import (
    ConsentAsked,
    ConsentHeard,
    Heard,
)
from ui_console.model.profile import Profile
from ui_console.session.feed import LogAway
from ui_console.terminal.app import ConsoleApp, read_value
from ui_console.terminal.driver import KeysDropped
from ui_console.terminal.tables import PanelName
from ui_console.terminal.widgets import Panel, Video


async def test_the_picker_takes_the_robot_chosen_and_escape_takes_none() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("p", "escape")
        await settle(pilot)
        assert session.wanted == []
        await pilot.press("p", "down", "enter")
        await settle(pilot)
    assert session.wanted == [("switch", "scout2")]


async def test_tab_goes_through_all_tables_and_back() -> None:
    screen = ConsoleApp(WrittenSession(*TEAM_EVENTS))
    async with screen.run_test(size=SIZE) as pilot:
        seen = []
        for _table in PanelName:
            seen.append(screen.chosen)
            await pilot.press("tab")
        assert seen == list(PanelName)
        await pilot.press("shift+tab")
        assert screen.chosen is PanelName.LOG


def crowd(own: str, robots: int = 60) -> WrittenSession:
    """Return the session of an operator who holds one of many robots."""
    many = [rc(f"scout{number}", "scout", []) for number in range(1, robots + 1)]
    asked, granted = (dataclasses.replace(event, robot=own) for event in (ASK, GRANT))
    return WrittenSession(Heard(8.0, msgspec.structs.replace(SCHEDULE, rcs=many)), asked, granted)


def robots_shown(app: ConsoleApp) -> list[str]:
    return re.findall(r"\bscout\d+\b", str(app.query_one("#robots", Panel).content))


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_the_operators_own_robot_is_always_among_the_robots_shown(size: tuple[int, int]) -> None:
    """At 80 × 24 there are six lines for sixty robots."""
    app = ConsoleApp(crowd("scout37"))
    async with app.run_test(size=size) as pilot:
        await settle(pilot)
        assert robots_shown(app)[:2] == ["scout37", "scout1"]
        assert app.query_one("#robots", Panel).row.subject == "scout37", "the cursor begins there"
        for keys in (["pagedown"] * 9, ["pageup"] * 30, ["pagedown"] * 70, ["tab"]):
            await pilot.press(*keys)
            await settle(pilot)
            shown = robots_shown(app)[:3]
            assert shown[0] == "scout37"
            assert len(set(shown)) == 3, "and it is shown once"


async def test_the_cursors_row_is_shown_below_the_own_robot() -> None:
    app = ConsoleApp(crowd("scout37"))
    async with app.run_test(size=(80, 24)) as pilot:
        await settle(pilot)
        await pilot.press(*["pagedown"] * 9)
        await settle(pilot)
        assert robots_shown(app)[:6] == ["scout37", *(f"scout{number}" for number in range(42, 47))]


async def test_the_log_of_the_whole_mission_is_searched_and_followed() -> None:
    def event(at_s: float, what: str) -> StoryEvent:
        return StoryEvent(at_s, "ui_console/console-1", what, "scout2", "")

    session = WrittenSession(*TEAM_EVENTS)
    session.log = Log([event(0.5, "tells of long ago"), event(9.0, "tells again")])
    app = ConsoleApp(session)
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("slash")
        await pilot.press(*"robot", "colon", *"scout2 ", *"tells", "enter")
        await settle(pilot)
        assert session.wanted == [("search", AskLog(robot="scout2", text="tells"))]
        told = screen_text(app)
        assert "log: robot:scout2 tells (2 events)" in told
        assert "tells of long ago" in told
        assert "saw motion" not in told
        for heard in (event(9.0, "tells again"), event(11.0, "tells news"), event(11.5, "is silent")):
            session.model.apply(Heard(12.0, heard))
        app.redraw()
        told = screen_text(app)
        assert told.count("tells again") == 1, "told and heard"
        assert "tells news" in told
        assert "is silent" not in told
        await pilot.press("slash", "delete", "enter")
        await settle(pilot)
        assert "saw motion" in screen_text(app)


@pytest.mark.parametrize(
    ("line", "refusal", "words"),
    [
        ("since:soon", None, "'soon' is no moment"),
        ("smoke", LogAway("the launcher, which keeps the log, did not answer"), "did not answer"),
    ],
)
async def test_a_search_that_fails_says_why_and_leaves_the_log_as_it_was(
    line: str, refusal: Refusal | None, words: str
) -> None:
    session = WrittenSession(*TEAM_EVENTS)
    session.log = refusal or Log([])
    app = ConsoleApp(session)
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("slash")
        await pilot.press(*("colon" if one == ":" else one for one in line), "enter")
        await settle(pilot)
        await pilot.pause()
        assert words in screen_text(app)
        assert app.chosen is not PanelName.LOG


async def test_the_cursor_stays_on_its_row_while_rows_come_and_go() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        await pilot.press("right_square_bracket", "right_square_bracket")
        panel = screen.query_one("#robots", Panel)
        assert panel.row is not None
        assert panel.row.subject == "scout2"
        screen.redraw()
        assert panel.row.subject == "scout2"
        await pilot.press("left_square_bracket")
        assert panel.row.subject == "scout1"


async def test_why_is_shown_and_closed_and_drives_nothing_meanwhile() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("y")
        await settle(pilot)
        assert "watch1 has its minimum run time" in screen_text(pilot.app)
        await pilot.press("w", "escape")
        await pilot.pause()
        assert "minimum run time" not in screen_text(pilot.app)
    assert session.wanted == [("why", "scout1")]


async def test_why_of_an_alarm_says_where_to_look_too() -> None:
    app = ConsoleApp(WrittenSession(*TEAM_EVENTS, Heard(11.0, STOP)))
    async with app.run_test(size=SIZE) as pilot:
        while app.chosen is not PanelName.ALARMS:
            await pilot.press("tab")
        await pilot.press("y")
        await settle(pilot)
        assert "where: scout on base" in screen_text(app)


async def test_why_without_a_row_says_so() -> None:
    app = ConsoleApp(WrittenSession())
    async with app.run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("y")
        await settle(pilot)
        assert [note.message for note in app._notifications] == ["robots has no row to explain"]  # noqa: SLF001


@pytest.mark.parametrize("is_sure", [True, False])
async def test_a_parameter_is_changed_by_typing_another_value(is_sure: bool) -> None:
    session = WrittenSession(*TEAM_EVENTS)
    session.is_sure = is_sure
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE, notifications=True) as pilot:
        while screen.chosen is not PanelName.PARAMETERS:
            await pilot.press("tab")
        await pilot.press("e")
        await pilot.pause()
        screen.screen.query_one(Input).value = "25"
        await pilot.press("enter")
        await settle(pilot)
        assert session.wanted == [("set", "watch1", "threshold", 25)]
        assert ("did not take" in screen_text(screen)) is not is_sure


async def test_who_asks_for_the_robot_and_why_is_on_the_status_line_with_the_keys_that_decide() -> None:
    shown = held_model()
    sought = Sought("ui_console/console-2", "ben", "scout1", "my robot is stuck", 18.0, number=1)
    shown.apply(sought)
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session)
    async with screen.run_test(size=(160, 36)) as pilot:
        await settle(pilot)
        assert "ben asks for scout1: my robot is stuck [g: yes, n: no; 6 s]" in screen_text(screen)
        shown.apply(Settled(sought, Consent(False, "anna", "no answer")))
        lift = Sought("ui_console/console-3", "cleo", "scout1", "", 18.0, Topic.LIFT, number=2)
        shown.apply(lift)
        await pilot.press("g")
        assert session.wanted[-1] == ("decide", True, 1), "the question on the screen, not the next one"
        shown.apply(Settled(lift, Consent(False, "anna", "no answer")))
        screen.redraw()
        await settle(pilot)
        assert "asks" not in screen_text(screen)


async def test_a_key_that_is_held_answers_one_question_and_not_the_next() -> None:
    shown = held_model()
    asked = [Sought(f"ui_console/console-{n}", "ben", f"scout{n}", "", 18.0, Topic.LIFT, number=n) for n in (1, 2)]
    for sought in asked:
        shown.apply(sought)
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session)
    async with screen.run_test(size=(160, 36)) as pilot:
        await settle(pilot)
        await pilot.press("g")
        shown.apply(Settled(asked[0], Consent(True, "anna", "")))
        screen.redraw()
        await pilot.press(*"gggg")
    assert session.wanted == [("decide", True, 1)]


@pytest.mark.parametrize("comes", [lambda: Key("g", "g"), KeysDropped])
async def test_a_key_from_before_the_question_does_not_answer_it(comes: Callable[[], Message]) -> None:
    """It waits for a busy console, or is held by a person since a pause of the console, whose keys are dropped."""
    shown = held_model()
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session)
    async with screen.run_test(size=(160, 36)) as pilot:
        await pilot.pause(2.0)
        before = comes()
        await pilot.pause(0.1)
        shown.apply(Sought("ui_console/console-2", "ben", "scout1", "stuck", 18.0, number=1))
        screen.redraw()
        screen.post_message(before)
        await settle(pilot)
        await pilot.press(*"ggg")
        assert session.wanted == []
        await pilot.pause(1.0)
        await pilot.press("g")
        assert session.wanted == [("decide", True, 1)]


async def test_a_pendants_holder_is_asked_in_the_same_words_and_answers_by_the_same_keys() -> None:
    shown = held_model()
    shown.apply(Sought("ui_console/console-2", "ben", "scout1", "stuck", 18.0, number=1))
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session, profile=Profile.PENDANT)
    async with screen.run_test(size=(50, 20)) as pilot:
        await settle(pilot)
        assert "ben asks for scout1: stuck [g: yes, n: no; 6 s]" in " ".join(screen_text(screen).split())
        await pilot.press("n")
    assert session.wanted == [("decide", False, 1)]


async def test_who_asks_may_say_why_and_sees_what_came_of_it() -> None:
    shown = model(*TEAM_EVENTS, ASK)
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session)
    async with screen.run_test(size=(160, 36)) as pilot:
        await pilot.press("M")
        await pilot.press(*"stuck", "enter")
        await settle(pilot)
        assert session.wanted[-1] == ("may I", "stuck")
        shown.apply(ConsentAsked(12.0, "scout1", ["console-2"], 18.0))
        screen.redraw()
        await settle(pilot)
        assert "asked console-2 for scout1: 6 s left" in screen_text(screen)
        shown.apply(ConsentHeard(13.0, "scout1", "ben", False, "nearly done"))
        screen.redraw()
        await settle(pilot)
        assert "ben keeps scout1: nearly done" in screen_text(screen)


def test_what_is_typed_is_json_or_the_text_itself() -> None:
    assert [read_value(text) for text in ("1", "0.5", "true", '"a"', "a b", "[1]")] == [1, 0.5, True, "a", "a b", [1]]


async def test_with_a_gamepad_the_keys_name_its_buttons_too() -> None:
    async with ConsoleApp(WrittenSession(), has_gamepad=True).run_test(size=(100, 60)) as pilot:
        await pilot.press("f1")
        await settle(pilot)
        assert "the left stick drives" in screen_text(pilot.app)


async def test_video_only_hides_everything_but_picture_and_status_and_brings_it_back() -> None:
    session = WrittenSession(shown=held_model())
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        await pilot.press("v")
        await pilot.pause()
        assert not screen.query_one("#side").display
        assert screen.query_one(Video).size.width == SIZE[0]
        assert screen.query_one(Video).size.height == SIZE[1] - 1
        await pilot.press("w", "v")
        await pilot.pause()
        assert screen.query_one("#side").display
    assert session.wanted == [FORWARD]
