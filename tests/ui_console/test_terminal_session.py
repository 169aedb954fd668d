"""How a screen ends, and what is told of it: in good order, by Ctrl-C, or by a bug."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, cast

import pytest
from textual.pilot import Pilot

from backbone.bus.clock import MissionClock
from backbone.cli import ExitCode
from backbone.component.messages import LifeState
from ui_console.observer import Observer
from ui_console.terminal.session import TerminalSession


class StandIn:
    """A component that lives until it is told to end, and notes what happened by then."""

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
