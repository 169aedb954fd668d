"""Every key of the terminal console does what the footer says, with a session that writes it down."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from console_scenes import ASK, GRANT, SCHEDULE, held_model
from pressed_keys import BACKWARD, FORWARD, KEYS, LEFT, MOST_M_S, RIGHT, SIZE
from screen_text import screen_text
from textual.binding import Binding
from textual.events import AppBlur, AppFocus, CursorPosition
from written_session import WrittenSession, settle

from ui_console.model.arc_abilities import ArcAbilities, Reach
from ui_console.model.driving import SPEED, SPEED_MOST, STICK_LASTS_S, MoveWish
from ui_console.model.events import (
    AbilitiesKnown,
    Heard,
    LinkTrouble,
)
from ui_console.model.profile import Profile
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.keys import DRIVES
from ui_console.terminal.keys import KEYS as KEYS_OF_THE_CONSOLE
from ui_console.terminal.tables import PanelName
from ui_console.terminal.widgets import ANSWERED_WITHIN_S, SAY_EVERY_S, DrivePad


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
        "C",
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


async def test_a_held_pad_lets_go_when_the_terminal_does_not_answer_for_a_second() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE, notifications=True) as pilot:
        await pilot.mouse_down(DrivePad, offset=(20, 1))
        for _ in range(20):
            await pilot.pause(0.1)
            screen.post_message(CursorPosition(1, 1))
        await pilot.pause()
        assert session.wanted
        assert "stop" not in session.wanted
        await pilot.pause(ANSWERED_WITHIN_S + 2 * SAY_EVERY_S)
        assert session.wanted[-1] == "stop"
        assert "Press anew" in screen_text(screen)
        session.wanted.clear()
        screen.post_message(CursorPosition(1, 1))
        await pilot.pause(0.5)
        assert session.wanted == []


async def test_the_mouse_alone_keeps_the_pad_of_a_terminal_that_never_answers() -> None:
    session = WrittenSession()
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.mouse_down(DrivePad, offset=(20, 1))
        for column in range(10, 16):
            await pilot.pause(ANSWERED_WITHIN_S / 2)
            await pilot.hover(DrivePad, offset=(column, 1))
        assert "stop" not in session.wanted


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
