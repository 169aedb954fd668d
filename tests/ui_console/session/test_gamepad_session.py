"""A console without a screen: a gamepad drives, stops and gives back, and what changes is printed once."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from types import SimpleNamespace
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from held_robot import HeldRobot
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from resource_pool.commands import Halt
from ui_console.model.console import ConsoleModel
from ui_console.model.state_lines import news
from ui_console.model.team import TeamModel
from ui_console.session.gamepad import (
    ABS_Y,
    BTN_EAST,
    BTN_NORTH,
    BTN_SELECT,
    BTN_START,
    BTN_TR,
    EV_ABS,
    EV_KEY,
    FIND_EVERY_S,
    NoGamepad,
)
from ui_console.session.gamepad_session import LIFT_REMEDY, GamepadSession
from ui_console.session.teleoperation import Teleoperation

RANGES = {ABS_Y: (-100, 100)}


class PlayedPad:
    """A gamepad in the hands of a test."""

    def __init__(self) -> None:
        self._events: asyncio.Queue[tuple[int, int, int] | None] = asyncio.Queue()

    def feel(self, kind: int, code: int, value: int) -> None:
        self._events.put_nowait((kind, code, value))

    def press(self, button: int) -> None:
        self.feel(EV_KEY, button, 1)
        self.feel(EV_KEY, button, 0)

    def unplug(self) -> None:
        self._events.put_nowait(None)

    async def async_read_loop(self) -> AsyncIterator[Any]:
        while (event := await self._events.get()) is not None:
            yield SimpleNamespace(type=event[0], code=event[1], value=event[2])
        raise OSError("No such device")


class Worn(HeldRobot):
    """The console, its gamepad, and its lines."""

    def __init__(self, placer: FakePlacer) -> None:
        super().__init__(placer, is_scripted=True)
        self.model = ConsoleModel("console-7", "anna", TeamModel("", LIFT_REMEDY), sees=False)
        self.lines: list[str] = []
        self.pad, self.next_pads = PlayedPad(), list[PlayedPad]()
        self.session = GamepadSession(self.model, self.lines.append, self._find)
        self.make_console(show=self.session.show, keeps_arc=True)

    def _find(self) -> Any:
        if not self.next_pads:
            raise NoGamepad("none is plugged in")
        return self.next_pads.pop(), RANGES

    async def run(self) -> None:
        await self.session.run(self.console, (self.pad, RANGES))

    async def says(self, words: str) -> None:
        await self.placer.wait(lambda: any(words in line for line in self.lines))


Scene = Callable[[Worn], Awaitable[None]]


@pytest.fixture
def worn(local_mission: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                on = Worn(placer)
                running = asyncio.create_task(on.run())
                try:
                    await on.held()
                    await scene(on)
                finally:
                    on.console.end("the scene is over")
                    await running
                    await on.rc.close()
                    await placer.close()

        run_virtual(main())

    return run


def test_the_stick_drives_while_the_dead_man_button_is_held(worn: Callable[[Scene], None]) -> None:
    async def scene(on: Worn) -> None:
        on.pad.feel(EV_ABS, ABS_Y, -100)
        await on.clock.sleep_s(0.5)
        assert on.drives() == []
        on.pad.feel(EV_KEY, BTN_TR, 1)
        await on.clock.sleep_s(0.5)
        driven = len(on.drives())
        assert driven > 1
        on.pad.feel(EV_KEY, BTN_TR, 0)
        await on.clock.sleep_s(0.5)
        assert isinstance(on.arc.commands[-1][2], Halt)
        assert len(on.drives()) == driven

    worn(scene)


def test_a_stop_is_carried_out_and_the_lines_say_who_stopped_and_where_to_lift(worn: Callable[[Scene], None]) -> None:
    async def scene(on: Worn) -> None:
        on.pad.press(BTN_EAST)
        await on.says("scout1 is STOPPED by anna")
        await on.says("alarm: scout1 was stopped by anna. When the robot may move, lift the stop at a console with a")
        assert on.latch.state.is_stopped

    worn(scene)


def test_a_stop_of_all_names_the_robots_that_did_not_confirm(
    worn: Callable[[Scene], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def stop_all(_console: object) -> list[str]:
        return ["scout2"]

    async def scene(on: Worn) -> None:
        monkeypatch.setattr(Teleoperation, "stop_all", stop_all)
        on.pad.press(BTN_NORTH)
        await on.says("NOT SURE that scout2 stopped")

    worn(scene)


def test_start_takes_and_select_gives_back(worn: Callable[[Scene], None]) -> None:
    async def scene(on: Worn) -> None:
        on.pad.press(BTN_SELECT)
        await on.placer.wait(lambda: on.arc.is_idle)
        on.pad.press(BTN_START)
        await on.placer.wait(lambda: not on.arc.is_idle)

    worn(scene)


def test_a_gamepad_that_is_gone_gives_the_robot_back_and_one_that_returns_can_take_it(
    worn: Callable[[Scene], None],
) -> None:
    async def scene(on: Worn) -> None:
        on.pad.feel(EV_ABS, ABS_Y, -100)
        on.pad.feel(EV_KEY, BTN_TR, 1)
        await on.placer.wait(on.drives)
        on.pad.unplug()
        await on.says("the gamepad is gone: you give the robot back")
        await on.placer.wait(lambda: on.arc.is_idle)
        driven = len(on.drives())
        await on.clock.sleep_s(3 * FIND_EVERY_S)
        assert len(on.drives()) == driven
        returned = PlayedPad()
        on.next_pads.append(returned)
        await on.says("the gamepad is there again: start takes the robot")
        returned.press(BTN_START)
        await on.placer.wait(lambda: not on.arc.is_idle)

    worn(scene)


NUMBERS = st.floats(0, 1e6, allow_nan=False).map(lambda value: f"{value:.1f}")


@given(st.lists(NUMBERS, min_size=2, max_size=2))
def test_a_line_of_which_only_a_number_changed_is_no_news(numbers: list[str]) -> None:
    before, now = (f"waiting: starts in {number} s" for number in numbers)
    assert news([before], [now]) == []
    assert news([before], [now, "let go, then press anew"]) == ["let go, then press anew"]
