"""A console's screen and its component, in one event loop."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable, Coroutine
from typing import assert_never

from textual import pilot as textual_pilot

from backbone.bus.interface import Clock
from backbone.launcher.endings import ExitCode
from resource_pool.arc_client import Frame
from ui_console.model.console import ConsoleModel
from ui_console.model.events import ConsoleEvent
from ui_console.model.orders import Order, OrderKind
from ui_console.model.profile import Profile
from ui_console.model.team import TeamModel
from ui_console.session.gamepad import FoundGamepad, PadWish, Stick, find_gamepad, play_gamepad, wait_gamepad
from ui_console.session.observer import AnyObserver
from ui_console.session.teleoperation import Teleoperation
from ui_console.session.verbs import Session
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.ending import EndingApp
from ui_console.terminal.hangup import HangupWatch
from ui_console.terminal.pixels import can_show_pixels

LIFT_REMEDY = "When the robot may move, press c, then l."
Pilot = Callable[[textual_pilot.Pilot[object]], Coroutine[object, None, None]]


class TerminalSession(Session):
    """Passes a component's events to the model, and the keys' commands to the component.

    Args:
        name: Name of the console.
        user: The person at it, for people and for the record.
        profile: Appearance of the screen.
        is_bare: True to begin with the picture alone.
        sees: True if pictures are expected.
        gamepad: Also drives.
        find: Finds the gamepad again after it disappeared.
    """

    def __init__(
        self,
        name: str,
        mission: str = "",
        user: str = "",
        *,
        profile: Profile = Profile.TERMINAL,
        is_bare: bool = False,
        sees: bool = True,
        gamepad: FoundGamepad | None = None,
        find: Callable[[], FoundGamepad] = find_gamepad,
    ) -> None:
        super().__init__(ConsoleModel(name, user, TeamModel(mission, LIFT_REMEDY), sees=sees))
        self._profile, self._is_bare, self._gamepad, self._find = profile, is_bare, gamepad, find

    def show(self, event: ConsoleEvent) -> None:
        """Apply an event to the model; the screen shows it at its next redraw."""
        self.model.apply(event)

    def see(self, frame: Frame) -> None:
        """Keep the newest picture; it is unpacked only when it is drawn."""
        self._frame = frame

    async def run(
        self, console: AnyObserver, *, pilot: Pilot | None = None, size: tuple[int, int] = (120, 40)
    ) -> ExitCode:
        """Show the screen until a key or the component ends it; the component ends first, then the screen.

        Args:
            console: The component.
            pilot: Presses keys on a screen without a terminal, instead of a person.
            size: Columns and lines of the pilot's screen.

        Returns:
            Outcome of the screen; a crash is already printed.

        Raises:
            BaseException: The bug or refusal that ended the component.
        """
        self._console = console
        screen = ConsoleApp(
            self,
            profile=self._profile if isinstance(console, Teleoperation) else Profile.MONITOR,
            has_pixels=pilot is None and can_show_pixels(os.environ),
            is_bare=self._is_bare,
            has_gamepad=self._gamepad is not None,
        )
        living = asyncio.create_task(console.run(), name="console")
        living.add_done_callback(lambda _living: screen.exit())
        playing = asyncio.create_task(self._play_gamepad(screen, console.clock), name="gamepad")
        try:
            if pilot is None:
                await on_terminal(screen, console.end)
            else:
                await screen.run_async(headless=True, size=size, auto_pilot=pilot)
        finally:
            playing.cancel()
            console.end("the screen was closed")
            await living
            await asyncio.wait({playing})
            if not playing.cancelled():
                playing.result()
        return ExitCode(screen.return_code or ExitCode.DONE)

    async def _play_gamepad(self, screen: ConsoleApp, clock: Clock) -> None:
        while self._gamepad is not None:
            device, ranges = self._gamepad
            await play_gamepad(
                device,
                Stick(ranges),
                hold=lambda forward, right, lasts_s: self.steer(forward, right, screen.speed, lasts_s),
                stop=self.stop,
                wish=lambda wish: self._begin_wish(wish, screen),
            )
            screen.notify("the gamepad is gone: drive by keys", severity="warning")
            self._gamepad = await wait_gamepad(clock, self._find)
            screen.notify("the gamepad is there again")

    def _begin_wish(self, wish: PadWish, screen: ConsoleApp) -> None:
        self.touch()
        match wish:
            case PadWish.JUMP:
                screen.action_jump()
            case PadWish.TAKE:
                self.take()
            case PadWish.RELEASE:
                self.release()
            case PadWish.STOP_ROBOT:
                screen.action_stop_robot()
            case PadWish.STOP_ALL:
                screen.action_stop_all()
            case PadWish.NEXT_ROBOT:
                self.begin_next_robot()
            case PadWish.WATCH:
                self.order(Order(OrderKind.WATCH, ""))
            case PadWish.RETURN:
                self.order(Order(OrderKind.RETURN, ""))
            case _:
                assert_never(wish)


async def on_terminal(screen: EndingApp, end: Callable[[str], None]) -> None:
    """Run the screen; if the terminal goes away, the console ends and releases the robot.

    Args:
        end: Ends the console, with the reason.
    """

    def gone() -> None:
        end("the terminal has gone away")
        screening.cancel()

    screening = asyncio.create_task(screen.run_async(), name="screen")
    watch = HangupWatch(sys.stdin.fileno(), gone)
    try:
        await asyncio.wait({screening})
        if not screening.cancelled():
            screening.result()
    finally:
        watch.close()
        screening.cancel()
