"""Ends of a screen, and their reports: in good order, by Ctrl-C, or by a bug."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest
from console_scenes import STOP
from textual.binding import Binding
from textual.pilot import Pilot

from backbone.bus.clock import MissionClock
from backbone.component.messages import LifeState
from backbone.launcher.endings import ExitCode
from ui_console.model.events import Heard
from ui_console.session.gamepad import BTN_EAST, BTN_NORTH, EV_KEY, FoundGamepad
from ui_console.session.observer import Observer
from ui_console.terminal.dialogs import LiftQuestion
from ui_console.terminal.keys import KEYS
from ui_console.terminal.session import TerminalSession


class StandIn:
    """A component that lives until it has to end, and notes the events until then."""

    def __init__(self, look: Callable[[], str] = str) -> None:
        self.clock = MissionClock.started_now()
        self.state = LifeState.READY
        self.ended_for: list[str] = []
        self.seen_at_end = ""
        self._look, self._end = look, asyncio.Event()

    async def run(self) -> None:
        await self._end.wait()

    def end(self, reason: str) -> None:
        if not self._end.is_set():
            self.ended_for.append(reason)
            self.seen_at_end = self._look()
        self._end.set()


async def ended(console: StandIn, *keys: str) -> ExitCode:
    async def press(pilot: Pilot[Any]) -> None:
        await pilot.press(*keys)

    session = TerminalSession("console-1")
    return await session.run(cast(Observer[Any], console), pilot=press)


@pytest.mark.parametrize(("key", "code"), [("q", ExitCode.DONE), ("ctrl+c", ExitCode.INTERRUPTED)])
async def test_a_screen_that_a_key_ends_says_so_by_its_code(key: str, code: ExitCode) -> None:
    console = StandIn()
    assert await ended(console, key) is code
    assert console.ended_for == ["the screen was closed"]


async def test_a_component_that_ends_ends_its_screen_in_good_order() -> None:
    console = StandIn()
    asyncio.get_running_loop().call_later(0.2, console.end, "SIGTERM")
    assert await ended(console) is ExitCode.DONE


async def test_a_crash_of_the_screen_never_ends_with_0_and_the_robot_goes_back_before_it_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_self: object) -> None:
        raise ZeroDivisionError("broken on purpose")

    monkeypatch.setattr("ui_console.terminal.app.ConsoleApp.action_keys", broken)
    console = StandIn(lambda: capsys.readouterr().err)
    assert await ended(console, "question_mark") is ExitCode.UNEXPECTED
    assert console.ended_for == ["the screen was closed"]
    assert "broken on purpose" not in console.seen_at_end
    assert "broken on purpose" in capsys.readouterr().err


class StopsAtOnce(StandIn):
    """A component whose stops are noted."""

    def __init__(self) -> None:
        super().__init__()
        self.stopped: list[str] = []
        self.all_are_stopped = asyncio.Event()

    async def stop_robot(self, robot: str) -> bool:
        self.stopped.append(robot)
        return True

    async def stop_all(self) -> list[str]:
        self.stopped.append("all")
        self.all_are_stopped.set()
        return []


class OneButtonPad:
    """A gamepad whose buttons are pressed, one after the other; then it rests, or it is unplugged."""

    def __init__(self, codes: list[int], *, is_unplugged: bool = False) -> None:
        self._codes, self._is_unplugged = codes, is_unplugged

    async def async_read_loop(self) -> AsyncIterator[Any]:
        for code in self._codes:
            await asyncio.sleep(0.3)
            yield SimpleNamespace(type=EV_KEY, code=code, value=1)
        if self._is_unplugged:
            raise OSError("No such device")
        await asyncio.Event().wait()


async def test_a_gamepads_buttons_stop_one_robot_and_all_with_a_dialog_in_front() -> None:
    console = StopsAtOnce()
    session = TerminalSession("console-1", gamepad=(OneButtonPad([BTN_EAST, BTN_NORTH]), {}))
    session.model.robot = "scout1"

    async def open_a_dialog(pilot: Pilot[Any]) -> None:
        await pilot.press("question_mark")
        await pilot.pause(1.0)
        await pilot.press("ctrl+q")

    await session.run(cast(Observer[Any], console), pilot=open_a_dialog)
    assert console.stopped == ["scout1", "all"]


async def test_a_gamepad_that_is_unplugged_is_reported_and_works_again_when_it_is_back() -> None:
    console, told, found = StopsAtOnce(), list[str](), [OneButtonPad([BTN_NORTH])]

    def find() -> FoundGamepad:
        return found.pop(), {}

    session = TerminalSession("console-1", gamepad=(OneButtonPad([BTN_EAST], is_unplugged=True), {}), find=find)
    session.model.robot = "scout1"

    async def look(pilot: Pilot[Any]) -> None:
        async with asyncio.timeout(10.0):
            await console.all_are_stopped.wait()
        told.extend(note.message for note in pilot.app._notifications)  # noqa: SLF001
        await pilot.press("ctrl+q")

    await session.run(cast(Observer[Any], console), pilot=look)
    assert console.stopped == ["scout1", "all"]
    assert told == ["the gamepad is gone: drive by keys", "the gamepad is there again"]


def test_the_remedy_of_a_stop_names_the_keys_of_a_terminal() -> None:
    session = TerminalSession("console-1")
    session.show(Heard(1.0, STOP))
    [alarm] = session.model.view(2.0).alarms
    assert alarm.remedy == "When the robot may move, press c, then l."
    keys = [binding for binding in KEYS if isinstance(binding, Binding)]
    assert next(binding.action for binding in keys if binding.key == "c") == "lift"
    assert [binding.action for binding in LiftQuestion.BINDINGS if isinstance(binding, Binding)] == ["lift"]
