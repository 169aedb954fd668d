"""The emergency stop of the terminal console works everywhere, only ever stops, and is lifted by other keys."""

from __future__ import annotations

import asyncio

import msgspec
import pytest
from bursts import burst
from console_scenes import SCHEDULE, STOP, TEAM_EVENTS, held_model, rc
from examples import some
from known_arcs import lit_types
from screen_text import screen_text
from textual.events import AppBlur
from textual.pilot import Pilot
from textual.widgets import Input
from written_session import WrittenSession, settle

from resource_pool.arc_client import Stopper
from ui_console.model.arc_abilities import arc_abilities
from ui_console.model.console import ConsoleModel
from ui_console.model.events import AbilitiesKnown, Asked, Heard
from ui_console.model.profile import Profile
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.dialogs import READ_S
from ui_console.terminal.keys import robot_meant, stop_meant
from ui_console.terminal.widgets import DrivePad

SIZE = (80, 24)
DIALOGS: dict[str, list[str]] = {
    "none": [],
    "picture alone": ["v"],
    "picker": ["p"],
    "why": ["y"],
    "keys": ["question_mark"],
    "reason": ["M"],
    "commands": ["o"],
    "fields of a command": ["o", "down", "enter"],
    "parameter": [*["tab"] * 6, "e"],
    "lift": ["c"],
    "lift of one's own stops": ["C"],
}
"""What is in front, and the keys that bring it there."""

NO_ROBOTS = {"links": 5, "parameters": 6, "log": 8}
"""Tables whose rows are no robots, and how many tables after the robots they come."""


def stopped_model() -> ConsoleModel:
    """Return one that holds scout1, which anna has stopped."""
    shown = held_model()
    shown.apply(AbilitiesKnown(10.9, arc_abilities("lit", lit_types("lit"))))
    shown.apply(Heard(11.0, STOP))
    return shown


async def opened(pilot: Pilot[None], name: str) -> None:
    await pilot.press(*DIALOGS[name])
    await settle(pilot)


STOP_ONE, STOP_ALL = ("stop robot", "scout1"), "stop all"
STOPPING = {"x": STOP_ONE, "X": STOP_ALL, "alt+x": STOP_ONE, "shift+x": STOP_ALL, "alt+shift+x": STOP_ALL}


@pytest.mark.parametrize("name", some(DIALOGS))
async def test_the_emergency_stop_works_whatever_is_in_front_and_is_never_typed(name: str) -> None:
    session = WrittenSession(shown=stopped_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await opened(pilot, name)
        before = [field.value for field in pilot.app.screen.query(Input)]
        for key, wanted in STOPPING.items():
            session.wanted.clear()
            await pilot.press(key)
            assert session.wanted == ["stop", wanted]
        await settle(pilot)
        assert [field.value for field in pilot.app.screen.query(Input)] == before


@pytest.mark.parametrize(("key", "wanted"), STOPPING.items())
async def test_a_stop_passes_the_keys_that_wait(key: str, wanted: object) -> None:
    """A key that is held repeats, and on a busy machine its repeats wait in a line."""
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        burst(pilot, *["d"] * 50, key)
        await settle(pilot)
    assert wanted in session.wanted[:5]
    assert session.wanted.count(wanted) == 1
    assert len(session.wanted) == 50 + len(["stop", wanted])


@pytest.mark.parametrize("profile", list(Profile))
async def test_every_profile_stops_one_robot_and_all(profile: Profile) -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE), shown=held_model())
    async with ConsoleApp(session, profile=profile).run_test(size=SIZE) as pilot:
        await pilot.press("x", "X")
        await settle(pilot)
    assert [one for one in session.wanted if one != "stop"] == [("stop robot", "scout1"), "stop all"]


async def test_a_text_may_hold_an_x_all_the_same() -> None:
    session = WrittenSession(*TEAM_EVENTS)
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("M")
        await settle(pilot)
        assert "ctrl+x types an x" in screen_text(pilot.app)
        await pilot.press(*"ne", "ctrl+x", *"t", "enter")
        await settle(pilot)
    assert session.wanted == [("may I", "next")]


@pytest.mark.parametrize("name", some(DIALOGS))
async def test_a_stop_pressed_twice_lifts_nothing(name: str) -> None:
    session = WrittenSession(shown=stopped_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await opened(pilot, name)
        for key in STOPPING:
            burst(pilot, key, key)
        await settle(pilot)
        await pilot.press("x", "enter", "X")
        await settle(pilot)
    assert not [one for one in session.wanted if isinstance(one, tuple) and one[0] == "lift"]


@pytest.mark.parametrize(
    "keys",
    [["c", "c"], ["c", "enter"], ["c", "space"], ["c", "x", "c"], ["c", "y"], ["l"], ["C", "C"], ["C", "x", "C"]],
)
async def test_no_key_pressed_twice_lifts_a_stop(keys: list[str]) -> None:
    session = WrittenSession(shown=stopped_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        burst(pilot, *keys)
        await settle(pilot)
    assert not [one for one in session.wanted if isinstance(one, tuple) and one[0] == "lift"]


@pytest.mark.parametrize("profile", list(Profile))
async def test_lifting_says_whose_stop_it_is_and_why_and_needs_another_key(profile: Profile) -> None:
    session = WrittenSession(shown=stopped_model())
    async with ConsoleApp(session, profile=profile).run_test(size=SIZE) as pilot:
        await pilot.press("c")
        await settle(pilot)
        told = screen_text(pilot.app)
        assert "lift the stop of scout1?" in told
        assert "anna" in told
        assert "child in the room" in told
        assert session.wanted == []
        await pilot.press("l")
        await settle(pilot)
    assert session.wanted == [("lift", "scout1", STOP.number)]


async def test_a_stop_set_anew_while_the_question_is_open_is_shown_and_not_lifted_unread() -> None:
    session = WrittenSession(shown=stopped_model())
    app = ConsoleApp(session)
    async with app.run_test(size=SIZE) as pilot:
        await pilot.press("c")
        await settle(pilot)
        again = msgspec.structs.replace(STOP, number=STOP.number + 1, by="ben", reason="smoke", at_s=11.5)
        session.model.apply(Heard(11.5, again))
        app.redraw()
        await pilot.press("l")
        await settle(pilot)
        told = screen_text(app)
        assert "set by ben" in told
        assert "smoke" in told
        assert session.wanted == []
        await pilot.pause(READ_S)
        await pilot.press("l")
        await settle(pilot)
    assert session.wanted == [("lift", "scout1", again.number)]


async def test_the_question_closes_when_somebody_else_lifts_the_stop() -> None:
    session = WrittenSession(shown=stopped_model())
    app = ConsoleApp(session)
    async with app.run_test(size=SIZE) as pilot:
        await pilot.press("c")
        await settle(pilot)
        session.model.apply(Heard(11.5, msgspec.structs.replace(STOP, is_stopped=False, by="ben")))
        app.redraw()
        await settle(pilot)
        assert len(app.screen_stack) == 1
    assert session.wanted == []


async def test_a_lift_that_was_not_granted_is_said_aloud() -> None:
    session = WrittenSession(shown=stopped_model())
    session.is_sure = False
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("c")
        await settle(pilot)
        await pilot.press("l")
        await settle(pilot)
        await pilot.pause()
        assert "scout1 stays stopped" in screen_text(pilot.app)


def crowd_stopped() -> WrittenSession:
    """Return the session of anna, who has stopped all of twelve robots, scout5 together with ben."""
    names = [f"scout{number}" for number in range(1, 13)]
    robots = msgspec.structs.replace(SCHEDULE, rcs=[rc(name, "scout", []) for name in names])
    stops = {name: msgspec.structs.replace(STOP, rc=name, number=number) for number, name in enumerate(names, 1)}
    stops["scout5"] = msgspec.structs.replace(stops["scout5"], also=[Stopper("ben", "ui_console/console-2")])
    return WrittenSession(Heard(8.0, robots), *(Heard(11.0, stop) for stop in stops.values()))


@pytest.mark.parametrize("profile", list(Profile))
async def test_an_operator_lifts_all_stops_of_his_own_by_one_question_and_no_other_stop(profile: Profile) -> None:
    session = crowd_stopped()
    async with ConsoleApp(session, profile=profile).run_test(size=SIZE) as pilot:
        await settle(pilot)
        assert "C lift your 11" in " ".join(screen_text(pilot.app).split())
        await pilot.press("C")
        await settle(pilot)
        assert "lift your 11 stops?" in screen_text(pilot.app)
        assert session.wanted == []
        await pilot.press("l")
        await settle(pilot)
    assert session.wanted == [("lift", f"scout{number}", number) for number in range(1, 13) if number != 5]


async def test_who_has_stopped_no_robot_alone_has_no_stops_to_lift_at_once() -> None:
    session = WrittenSession(Heard(8.0, SCHEDULE), Heard(11.0, msgspec.structs.replace(STOP, by="ben")))
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await settle(pilot)
        await pilot.press("C", "l")
        await settle(pilot)
        await pilot.pause()
        assert "you alone have stopped no robot" in screen_text(pilot.app)
    assert session.wanted == []


async def test_where_no_robot_is_stopped_lifting_says_so() -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE, notifications=True) as pilot:
        await pilot.press("c")
        await settle(pilot)
        await pilot.pause()
        assert "no robot is stopped" in screen_text(pilot.app)
    assert session.wanted == []


@pytest.mark.parametrize("name", [*NO_ROBOTS, "keys"])
async def test_a_robot_that_the_cursor_was_moved_to_is_meant_in_every_table_and_dialog(name: str) -> None:
    session = WrittenSession(*TEAM_EVENTS, Heard(8.0, SCHEDULE))
    async with ConsoleApp(session, profile=Profile.MONITOR).run_test(size=SIZE) as pilot:
        await pilot.press(*["shift+tab"] * 3, "right_square_bracket")
        await pilot.press(*["tab"] * NO_ROBOTS.get(name, 0), *DIALOGS.get(name, []))
        await settle(pilot)
        assert name == "keys" or "STOP scout2" in screen_text(pilot.app)
        await pilot.press("x")
        await settle(pilot)
    assert session.wanted == ["stop", ("stop robot", "scout2")]


@pytest.mark.parametrize(("keys", "meant"), [("p", "scout2"), ("p up", "scout1")])
async def test_a_stop_in_the_picker_is_for_the_robot_that_the_console_asks_for_until_the_cursor_moves(
    keys: str, meant: str
) -> None:
    session = WrittenSession(*TEAM_EVENTS, Heard(8.0, SCHEDULE), Asked(8.5, "scout2", "drive", 100))
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        for key in keys.split():
            await pilot.press(key)
            await settle(pilot)
        await pilot.press("x")
        await settle(pilot)
    assert session.wanted == ["stop", ("stop robot", meant)]


class SlowSession(WrittenSession):
    """Its stops take a moment, and are not confirmed; writes down its end, too."""

    async def stop_robot(self, robot: str) -> bool:
        await asyncio.sleep(0.05)
        await super().stop_robot(robot)
        return False

    async def stop_all(self) -> list[str]:
        await asyncio.sleep(0.05)
        return [*await super().stop_all(), "scout2"]

    def closed(self) -> None:
        self.wanted.append("closed")


@pytest.mark.parametrize("leave", ["q", "ctrl+c"])
@pytest.mark.parametrize(("key", "stop"), [("x", ("stop robot", "scout1")), ("X", "stop all")])
async def test_a_stop_is_carried_out_before_a_console_that_is_left_at_once_ends(
    key: str, stop: object, leave: str
) -> None:
    session = SlowSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await settle(pilot)
        burst(pilot, key, leave)
    assert session.wanted == ["stop", stop, "closed"]


def test_a_stop_is_for_the_robot_in_hand_then_for_the_row_then_for_the_one_wanted() -> None:
    at_hand = {"held": "scout1", "placed": "scout2", "wanted": "scout3", "shown": "scout4"}
    for name, robot in at_hand.copy().items():
        assert robot_meant(**at_hand) == robot
        at_hand[name] = ""
    assert robot_meant(**at_hand) == ""


def test_lifting_is_for_the_row_then_for_the_robot_in_hand_and_only_for_stopped_ones() -> None:
    at_hand = {"held": "scout1", "placed": "scout2", "wanted": "", "shown": "scout4"}
    assert stop_meant(["scout1", "scout2"], **at_hand) == "scout2"
    assert stop_meant(["scout1", "scout3"], **at_hand) == "scout1"
    assert stop_meant(["scout3"], **at_hand) == "scout3", "there is only one"
    assert stop_meant(["scout3", "scout5"], **at_hand) == ""


async def test_what_is_held_down_must_be_let_go_when_a_dialog_opens_and_when_it_closes() -> None:
    session = WrittenSession(shown=stopped_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        for name, keys in DIALOGS.items():
            before = session.must_let_go
            await opened(pilot, name)
            is_dialog = len(pilot.app.screen_stack) > 1
            assert is_dialog == (name not in ("none", "picture alone")), keys
            assert session.must_let_go == before + is_dialog
            await pilot.press("escape")
            await settle(pilot)
            assert session.must_let_go == before + 2 * is_dialog


@pytest.mark.parametrize("how", ["dialog", "window"])
async def test_the_drag_pad_lets_go_when_a_dialog_opens_or_the_window_is_left(how: str) -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=(120, 40)) as pilot:
        await pilot.mouse_down(DrivePad, offset=(20, 1))
        await pilot.pause()
        assert session.wanted
        if how == "dialog":
            await pilot.press("p")
        else:
            pilot.app.post_message(AppBlur())
        await settle(pilot)
        session.wanted.clear()
        await pilot.pause(0.3)
        assert session.wanted == []
