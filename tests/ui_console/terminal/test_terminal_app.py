"""Every key of the terminal console does what the footer says, with a session that writes it down."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from console_scenes import ASK, GRANT, SCHEDULE, STOP, TEAM_EVENTS, held_model, model
from screen_text import same_as_before, screen_text
from textual.binding import Binding
from textual.events import AppBlur, AppFocus
from textual.widgets import Input
from written_session import WrittenSession, settle

from backbone.component.messages import StoryEvent
from backbone.errors import Refusal
from backbone.mission_log.log import AskLog, Log
from resource_pool.arc_client import Suspended
from ui_console.model.arc_abilities import SLOW, ArcAbilities, Reach
from ui_console.model.consent import Consent, Settled, Sought
from ui_console.model.driving import SPEED, SPEED_MOST, STICK_LASTS_S, GiveWish, MoveWish
from ui_console.model.events import (
    AbilitiesKnown,
    Attention,
    ConsentAsked,
    ConsentHeard,
    ConsoleEvent,
    GivenBack,
    Heard,
    LinkHeard,
    LinkTrouble,
)
from ui_console.model.profile import Profile
from ui_console.session.feed import LogAway
from ui_console.terminal.app import ConsoleApp, read_value
from ui_console.terminal.keys import DRIVES
from ui_console.terminal.keys import KEYS as KEYS_OF_THE_CONSOLE
from ui_console.terminal.tables import PanelName
from ui_console.terminal.widgets import DrivePad, Panel, Video

SIZE = (120, 36)


MOST_M_S, MOST_RAD_S = SLOW.forward_m_s, SLOW.turn_rad_s  # the sessions here know no better reach
FORWARD, BACKWARD = MoveWish(SPEED * MOST_M_S, 0.0), MoveWish(-SPEED * MOST_M_S, 0.0)
LEFT, RIGHT = MoveWish(0.0, SPEED * MOST_RAD_S / 2), MoveWish(0.0, -SPEED * MOST_RAD_S / 2)
KEYS: list[tuple[str, list[Any]]] = [
    ("up", [FORWARD]),
    ("w", [FORWARD]),
    ("down", [BACKWARD]),
    ("s", [BACKWARD]),
    ("left", [LEFT]),
    ("a", [LEFT]),
    ("right", [RIGHT]),
    ("d", [RIGHT]),
    ("space", ["stop"]),
    ("escape", ["stop"]),
    ("j", [GiveWish("jump")]),
    ("o", []),
    ("N", [("switch", "scout1")]),
    ("O", []),
    ("r", ["release"]),
    ("t", ["take"]),
    ("m", [("may I", "")]),
    ("g", [("decide", True)]),
    ("n", [("decide", False)]),
    ("x", ["stop", ("stop robot", "scout1")]),
    ("X", ["stop", "stop all"]),
    ("alt+x", ["stop", ("stop robot", "scout1")]),
    ("shift+x", ["stop", "stop all"]),
    ("alt+shift+x", ["stop", "stop all"]),
    ("c", []),
    ("1", [("switch", "scout1")]),
    ("2", [("switch", "scout2")]),
    ("3", []),
    ("y", [("why", "scout1")]),
    ("i", [("ask", "scout1")]),
    ("k", [("acknowledge", "no_answer:")]),
    ("K", [("acknowledge", "")]),
    ("b", ["views"]),
    ("enter", []),
]


async def test_every_key_does_what_it_says() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE), LinkTrouble(9.0, "nobody"))
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        for number, (key, wanted) in enumerate(KEYS, 1):
            session.wanted.clear()
            await pilot.press(key)
            await settle(pilot)
            assert session.wanted == wanted, key
            if len(pilot.app.screen_stack) > 1:
                await pilot.press("escape")
            assert session.touched >= number


def test_every_key_the_console_knows_is_tried_here() -> None:
    elsewhere = {
        "M",
        "plus",
        "equals_sign",
        "minus",
        "p",
        "tab",
        "shift+tab",
        "q",
        "ctrl+c",
        "ctrl+q",
        "alt+q",
        "v",
        "question_mark",
        "f1",
        "e",
        "slash",
        "B",
    }
    elsewhere |= {"left_square_bracket", "pageup", "right_square_bracket", "pagedown", "4", "5", "6", "7", "8", "9"}
    known = set(ConsoleApp(WrittenSession())._bindings.key_to_bindings)  # noqa: SLF001  what the footer is made of
    assert known == {key for key, _wanted in KEYS} | elsewhere


def test_the_reference_names_every_key_and_who_has_it() -> None:
    page = (Path(__file__).parents[3] / "docs/reference/console-keys.md").read_text()
    profiles = {"attach": Profile.TERMINAL, "pendant": Profile.PENDANT, "monitor": Profile.MONITOR}
    listed: dict[str, set[str]] = {}
    for keys, who in re.findall(r"^\| ((?:`[^`]+` ?)+)\|[^|]*\| ([a-z, ]+) \|$", page, re.MULTILINE):
        for key in re.findall(r"`([^`]+)`", keys):
            listed[key] = set(profiles) if who == "all" else set(who.split(", "))
    for name, profile in profiles.items():
        screen = ConsoleApp(WrittenSession(), profile=profile)
        bindings = screen._bindings.key_to_bindings  # noqa: SLF001  what the footer is made of
        can = {key for key, found in bindings.items() if screen.check_action(found[0].action.partition("(")[0], ())}
        assert {key for key, who in listed.items() if name in who} == can


def test_the_how_to_names_only_keys_that_there_are() -> None:
    page = (Path(__file__).parents[3] / "docs/how-to/operate-from-a-terminal.md").read_text().replace("```", "")
    signs = {"plus": "+", "minus": "-", "slash": "/", "question_mark": "?"}
    signs |= {"left_square_bracket": "[", "right_square_bracket": "]"}
    known = {signs.get(binding.key, binding.key) for binding in Binding.make_bindings(KEYS_OF_THE_CONSOLE)}
    lifts = {"l"}
    assert set(re.findall(r"`(\S)`", page)) <= known | lifts
    assert {"x", "X", "c", "l", "t", "r", "m", "g", "n", "/", "y"} <= set(re.findall(r"`(\S)`", page))


async def test_plus_and_minus_change_the_speed_of_the_next_press_within_bounds() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test() as pilot:
        await pilot.press("plus", "w", "minus", "minus", "w", "equals_sign")
        assert session.wanted == [MoveWish(0.3 * MOST_M_S, 0.0), MoveWish(0.2 * MOST_M_S, 0.0)]
        await pilot.press(*["plus"] * 16)
        assert screen.speed == SPEED_MOST


@pytest.mark.parametrize(("key", "code"), [("q", 0), ("alt+q", 0), ("ctrl+q", 0), ("ctrl+c", 130)])
async def test_q_and_ctrl_c_quit_and_say_how_it_ended(key: str, code: int) -> None:
    screen = ConsoleApp(WrittenSession())
    async with screen.run_test() as pilot:
        await pilot.press(key)
        await pilot.pause()
        assert not screen.is_running
    assert screen.return_code == code


async def test_leaving_the_window_stops_the_wheels_and_coming_back_is_noticed() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test() as pilot:
        screen.post_message(AppBlur())
        await pilot.pause()
        assert session.wanted == ["leave"]
        screen.post_message(AppFocus())
        await pilot.pause()
    assert session.touched == 1


# ---------------------------------------------------------------------- emergency stop
async def test_without_a_robot_of_ones_own_the_stop_is_for_the_row_the_cursor_is_on() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("x")
        await settle(pilot)
        assert ("stop robot", "scout2") not in session.wanted
        while pilot.app.chosen is not PanelName.ROBOTS:
            await pilot.press("tab")
        await pilot.press("right_square_bracket", "x")
        await settle(pilot)
    assert session.wanted[-1] == ("stop robot", "scout2")


async def test_with_a_robot_of_ones_own_the_stop_is_for_that_one_wherever_the_cursor_is() -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("pagedown", "x")
        await settle(pilot)
    assert session.wanted == ["stop", ("stop robot", "scout1")]


@pytest.mark.parametrize(("key", "said"), [("x", "scout1 did not confirm"), ("X", "not confirmed: scout2")])
async def test_a_stop_nobody_confirmed_is_said_aloud(key: str, said: str) -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    session.is_sure = False
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press(key)
        await settle(pilot)
        await pilot.pause()
        assert said in screen_text(pilot.app)


# ---------------------------------------------------------------------- robots, tables, dialogs
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
    sought = Sought("ui_console/console-2", "ben", "scout1", "my robot is stuck", 18.0)
    shown.apply(sought)
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session)
    async with screen.run_test(size=(160, 36)) as pilot:
        await settle(pilot)
        assert "ben asks for scout1: my robot is stuck [g: yes, n: no; 6 s]" in screen_text(screen)
        await pilot.press("g")
        assert session.wanted[-1] == ("decide", True)
        shown.apply(Settled(sought, Consent(True, "anna", "")))
        screen.redraw()
        await settle(pilot)
        assert "ben asks" not in screen_text(screen)


async def test_a_pendants_holder_is_asked_in_the_same_words_and_answers_by_the_same_keys() -> None:
    shown = held_model()
    shown.apply(Sought("ui_console/console-2", "ben", "scout1", "stuck", 18.0))
    session = WrittenSession(shown=shown)
    screen = ConsoleApp(session, profile=Profile.PENDANT)
    async with screen.run_test(size=(50, 20)) as pilot:
        await settle(pilot)
        assert "ben asks for scout1: stuck [g: yes, n: no; 6 s]" in " ".join(screen_text(screen).split())
        await pilot.press("n")
    assert session.wanted == [("decide", False)]


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


# ---------------------------------------------------------------------- the drag pad
async def test_dragging_in_the_pad_drives_until_it_is_let_go() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        pad = screen.query_one(DrivePad)
        middle = (pad.region.width // 2, 1)
        await pilot.mouse_down(pad, offset=middle)
        await pilot.pause(0.35)
        await pilot.mouse_up(pad, offset=middle)
        await pilot.pause(0.2)
    held = [one for one in session.wanted if one != "stop"]
    assert len(held) >= 3
    assert session.wanted[-1] == "stop"
    drive, lasts_s = held[0]
    assert lasts_s == STICK_LASTS_S
    assert drive.turn_rad_s == pytest.approx(0.0, abs=0.02)
    assert drive.forward_m_s > 0.5 * SPEED * MOST_M_S


async def test_keys_and_pad_drive_within_the_reach_of_the_body_and_not_at_all_without_one() -> None:
    session = WrittenSession(ASK)
    session.model.apply(AbilitiesKnown(9.0, ArcAbilities(Reach(2.0, 4.0), True, [])))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        await pilot.press("w", "a")
        assert session.wanted == [MoveWish(0.5, 0.0), MoveWish(0.0, 0.5)]
        assert "speed 25 % (0.50 m/s)" in screen_text(screen)
        session.model.apply(AbilitiesKnown(9.1, ArcAbilities(None, False, [])))
        screen.redraw()
        await pilot.press("w")
        await pilot.pause()
        assert screen.query_one(DrivePad).disabled
        assert "no pictures: this kind of ARC has no camera" not in screen_text(screen)
        session.model.apply(GRANT)
        screen.redraw()
        screen.redraw_video()
        await pilot.pause()
        assert "no pictures: this kind of ARC has no camera" in screen_text(screen)
        assert len(session.wanted) == 2
        assert "speed" not in screen_text(screen).splitlines()[0]


# ---------------------------------------------------------------------- profiles
async def test_a_monitor_has_no_keys_that_drive() -> None:
    session = WrittenSession()
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press("w", "space", "j", "r", "t", "1", "p", "enter", "plus", "v")
        assert screen_text(pilot.app)
    assert session.wanted == []
    assert {"drive", "jump", "take", "release"} <= DRIVES


async def test_a_pendant_drives_with_six_keys_and_stops_with_two_more() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE))
    async with ConsoleApp(session, profile=Profile.PENDANT).run_test(size=(50, 20)) as pilot:
        await pilot.press("up", "down", "left", "right", "space", "enter")
        await pilot.press("j", "t", "r", "y", "1", "p", "v", "k")
        await settle(pilot)
        assert session.wanted == [FORWARD, BACKWARD, LEFT, RIGHT, "stop", "take"]
        session.wanted.clear()
        await pilot.press("x", "X")
        await settle(pilot)
    assert session.wanted == ["stop", ("stop robot", "scout1"), "stop", "stop all"]


async def test_the_pendants_key_gives_back_what_is_wanted_or_held() -> None:
    session = WrittenSession(ASK, GRANT)
    async with ConsoleApp(session, profile=Profile.PENDANT).run_test(size=(50, 20)) as pilot:
        await pilot.press("enter")
    assert session.wanted == ["release"]


# ---------------------------------------------------------------------- no link, and a robot that was lost
@pytest.mark.parametrize("profile", list(Profile))
async def test_a_console_without_a_link_says_across_the_screen_that_it_stops_nothing(profile: Profile) -> None:
    session = WrittenSession(shown=held_model())
    app = ConsoleApp(session, profile=profile)
    async with app.run_test(size=(80, 24)) as pilot:
        session.model.apply(LinkHeard(11.0, False))
        await pilot.pause(0.5)  # no key is pressed: it is the console that has to look
        shown = " ".join(screen_text(app).split())
        assert "NO LINK to the mission" in shown
        assert "x and X reach no robot now: stop at another console, or at the robot itself" in shown
        assert "you hold" not in shown
        assert app.screen.has_class("-unlinked")
        session.model.apply(LinkHeard(11.5, True, 0.001))
        await pilot.pause(0.5)
        assert "NO LINK" not in screen_text(app)
        assert not app.screen.has_class("-unlinked")


async def test_a_robot_that_was_lost_is_taken_again_by_one_key_or_known_to_be_lost_by_another() -> None:
    shown = held_model()
    shown.apply(GivenBack(11.0, "anna is away", True, wanted=False))
    session = WrittenSession(shown=shown)
    app = ConsoleApp(session)
    async with app.run_test(size=(80, 24)) as pilot:
        await settle(pilot)
        told = "you lost scout1 1 s ago: anna is away [t: take it again, k: seen]"
        assert told in " ".join(screen_text(app).split())
        await pilot.press("t", "k")
        await settle(pilot)
        assert session.wanted == ["take", "dismiss lost"]
        assert "you lost" not in screen_text(app)


# ---------------------------------------------------------------------- the picture
async def test_the_screen_shows_picture_holder_and_status() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        first = screen_text(screen).splitlines()[0]
        assert "you hold scout1" in first
        assert "picture 0.2 s old" in first
        line = screen.query_one(Video).render_line(2)
        assert "▀" in line.text
        assert line.cell_length == screen.query_one(Video).size.width


async def test_a_terminal_with_real_pixels_is_sent_the_picture_once_and_cells_that_name_it() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    screen = ConsoleApp(session, has_pixels=True)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        first, second = video.render_line(0), video.render_line(1)
        assert (first.cell_length, second.cell_length) == (video.size.width, video.size.width)
        assert "\x1b_Ga=T" in first.text
        assert "\x1b" not in second.text
        session.now_s = lambda: 20.0  # type: ignore[method-assign]
        screen.redraw()
        assert "\x1b_G" not in video.render_line(0).text, "an old picture is drawn dark, in half blocks"


async def test_an_old_picture_says_so_across_the_picture() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    session.now_s = lambda: 20.0  # type: ignore[method-assign]
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        assert "picture is 8 s old" in video.render_line(video.size.height // 2).text


async def test_a_robot_that_was_taken_away_says_by_whom_across_the_picture() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    session.model.apply(Heard(11.9, Suspended("arc", "higher", "console-2", -1.0)))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        assert "console-2 has the higher priority" in video.render_line(video.size.height // 2).text


# ---------------------------------------------------------------------- every screen as it was when somebody looked
ALARMING: list[ConsoleEvent] = [
    Attention(8.0, False),
    LinkTrouble(9.0, "nobody answers at resource_pool/scout2"),
    Attention(9.5, True),
    Heard(11.0, STOP),
]


async def test_every_table_looks_as_it_did() -> None:
    shown = held_model()
    for event in ALARMING:
        shown.apply(event)
    screen = ConsoleApp(WrittenSession(shown=shown))
    async with screen.run_test(size=SIZE) as pilot:
        for panel in PanelName:
            assert screen.chosen is panel
            await pilot.pause()
            same_as_before(screen, f"table-{panel}")
            await pilot.press("tab")


@pytest.mark.parametrize(
    ("name", "profile", "size", "keys"),
    [
        ("attach-narrow", Profile.TERMINAL, (60, 40), []),
        ("attach-80x24", Profile.TERMINAL, (80, 24), []),
        ("dialog-lift", Profile.TERMINAL, (80, 24), ["c"]),
        ("attach-video-only", Profile.TERMINAL, (80, 24), ["v"]),
        ("pendant", Profile.PENDANT, (50, 20), []),
        ("monitor", Profile.MONITOR, SIZE, []),
        ("dialog-picker", Profile.TERMINAL, SIZE, ["p"]),
        ("dialog-why", Profile.TERMINAL, SIZE, ["y"]),
        ("dialog-keys", Profile.TERMINAL, (120, 50), ["question_mark"]),
        ("dialog-parameter", Profile.TERMINAL, SIZE, [*["tab"] * 6, "e"]),
    ],
)
async def test_every_screen_looks_as_it_did(
    name: str, profile: Profile, size: tuple[int, int], keys: list[str]
) -> None:
    session = WrittenSession(shown=held_model())
    if name == "dialog-lift":
        session.model.apply(Heard(11.0, msgspec.structs.replace(STOP, by="ben")))
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    screen = ConsoleApp(session, profile=profile)
    async with screen.run_test(size=size) as pilot:
        await pilot.pause()
        screen.redraw()
        await pilot.pause()
        for key in keys:
            await pilot.press(key)
        await settle(pilot)
        screen.redraw()
        await pilot.pause()
        same_as_before(screen, name)
