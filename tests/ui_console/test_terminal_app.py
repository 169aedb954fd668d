"""Every key of the terminal console does what the footer says, with a session that writes it down."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from textual.events import AppBlur
from textual.widgets import Static

from backbone.rc_manager.messages import Holder, RcView, Schedule
from ui_console.console_events import Asked, Granted, PictureSeen, ScheduleHeard
from ui_console.console_model import ConsoleModel
from ui_console.driving import Drive
from ui_console.terminal.app import SPEED_MOST_RAD_S, ConsoleApp, Video


class WrittenSession:
    """Writes down what keys want."""

    def __init__(self) -> None:
        self.model = ConsoleModel("console-1")
        self.wanted: list[object] = []
        self.shown: NDArray[np.uint8] | None = None

    def picture(self) -> NDArray[np.uint8] | None:
        return self.shown

    def now_s(self) -> float:
        return 12.0

    def hold(self, drive: Drive) -> None:
        self.wanted.append(drive)

    def stop(self) -> None:
        self.wanted.append("stop")

    def jump(self) -> None:
        self.wanted.append("jump")

    def take(self) -> None:
        self.wanted.append("take")

    def release(self) -> None:
        self.wanted.append("release")


FORWARD, BACKWARD = Drive(4.0, 4.0), Drive(-4.0, -4.0)
LEFT, RIGHT = Drive(-2.0, 2.0), Drive(2.0, -2.0)
KEYS: list[tuple[str, object]] = [
    ("up", FORWARD),
    ("w", FORWARD),
    ("down", BACKWARD),
    ("s", BACKWARD),
    ("left", LEFT),
    ("a", LEFT),
    ("right", RIGHT),
    ("d", RIGHT),
    ("space", "stop"),
    ("escape", "stop"),
    ("j", "jump"),
    ("r", "release"),
    ("t", "take"),
]


@pytest.mark.parametrize(("key", "wanted"), KEYS, ids=[key for key, _wanted in KEYS])
async def test_a_key_does_what_it_says(key: str, wanted: object) -> None:
    session = WrittenSession()
    async with ConsoleApp(session).run_test() as pilot:
        await pilot.press(key)
    assert session.wanted == [wanted]


async def test_plus_and_minus_change_the_speed_of_the_next_press_within_bounds() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test() as pilot:
        await pilot.press("plus", "w", "minus", "minus", "w")
        assert session.wanted == [Drive(5.0, 5.0), Drive(3.0, 3.0)]
        await pilot.press(*["plus"] * 13)
        assert screen.speed_rad_s == SPEED_MOST_RAD_S


async def test_q_quits() -> None:
    screen = ConsoleApp(WrittenSession())
    async with screen.run_test() as pilot:
        await pilot.press("q")
        await pilot.pause()
        assert not screen.is_running


async def test_leaving_the_window_stops_the_wheels() -> None:
    session = WrittenSession()
    screen = ConsoleApp(session)
    async with screen.run_test() as pilot:
        screen.post_message(AppBlur())
        await pilot.pause()
    assert session.wanted == ["stop"]


async def test_a_monitor_has_no_keys_that_drive() -> None:
    session = WrittenSession()
    async with ConsoleApp(session, drives=False).run_test() as pilot:
        await pilot.press("w", "space", "j", "r", "t")
    assert session.wanted == []


async def test_the_screen_shows_picture_holder_and_status() -> None:
    session = WrittenSession()
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    schedule = Schedule(
        8.0, [RcView("scout1", "scout", "held", False, 1.0, [Holder("watch1-capture", 6, 5.0, 9.0)], 6, [])], [], []
    )
    session.model.apply(Asked(9.0, "scout1", "capture", 100))
    session.model.apply(Granted(10.0, {"scout": "scout1"}, {"scout1": 7}, 15.0, 9.0, False))
    session.model.apply(PictureSeen(11.9, 11.5, "scout1"))
    session.model.apply(ScheduleHeard(11.0, schedule))
    screen = ConsoleApp(session)
    async with screen.run_test(size=(120, 30)) as pilot:
        screen.redraw()
        await pilot.pause()
        status = str(screen.query_one("#status", Static).render())
        assert "you hold scout1 (epoch 7)" in status
        assert "picture 0.5 s old" in status
        line = screen.query_one(Video).render_line(2)
        assert "▀" in line.text
        assert line.cell_length == screen.query_one(Video).size.width
