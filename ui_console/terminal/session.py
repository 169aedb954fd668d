"""A console's screen and its component, in one event loop."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable, Coroutine, Mapping
from datetime import datetime
from typing import Any, assert_never

import numpy as np
from numpy.typing import NDArray
from textual import pilot as textual_pilot

from backbone.component.messages import LifeState
from backbone.endings import ExitCode
from backbone.log_question import LogQuestion
from backbone.mission_log import AskLog, Log
from backbone.moments import Now
from resource_pool.arc_client import Frame
from ui_console.console_events import ConsoleEvent
from ui_console.console_model import ConsoleModel
from ui_console.driving import Drive
from ui_console.gamepad import Gamepad, PadWish, Stick, play_gamepad
from ui_console.observer import Observer
from ui_console.profile import Profile
from ui_console.team_model import TeamModel
from ui_console.teleoperation import Teleoperation
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.hangup import HangupWatch
from ui_console.terminal.pixels import can_show_pixels

LIFT_REMEDY = "When the robot may move, press c, then l."
Pilot = Callable[[textual_pilot.Pilot[Any]], Coroutine[Any, Any, None]]


class TerminalSession:
    """Hands what a component hears to the model, and what keys want to the component.

    Args:
        name: Name of the console.
        mission: Name of the mission.
        user: Who sits at it, for people and for the record.
        profile: How the screen looks.
        is_bare: True to begin with the picture alone.
        sees: True if pictures are to come.
        gamepad: Device to drive by, with the ranges of its stick.
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
        gamepad: tuple[Gamepad, Mapping[int, tuple[int, int]]] | None = None,
    ) -> None:
        self.model = ConsoleModel(name, user, TeamModel(mission, LIFT_REMEDY), sees=sees)
        self._profile, self._is_bare, self._gamepad = profile, is_bare, gamepad
        self._console: Observer[Any] | None = None
        self._frame: Frame | None = None
        self._picture: NDArray[np.uint8] | None = None

    def show(self, event: ConsoleEvent) -> None:
        """Take an event into the model; the screen reads it at its next redraw."""
        self.model.apply(event)

    def see(self, frame: Frame) -> None:
        """Keep the newest picture; it is unpacked only if it gets drawn."""
        self._frame = frame

    async def run(
        self, console: Observer[Any], *, pilot: Pilot | None = None, size: tuple[int, int] = (120, 40)
    ) -> ExitCode:
        """Show the screen until a key or the component ends it; both have ended afterwards, the component first.

        Args:
            console: The component.
            pilot: Presses the keys, on a screen nobody sees, in place of a person at a terminal.
            size: Columns and lines of the pilot's screen.

        Returns:
            How the screen ended; a screen that crashed has said why by now.

        Raises:
            BaseException: What ended the component, if that was a bug or a refusal.
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
        playing = asyncio.create_task(self._play_gamepad(screen), name="gamepad")
        try:
            if pilot is None:
                await self._on_terminal(screen, console)
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

    async def _play_gamepad(self, screen: ConsoleApp) -> None:
        if self._gamepad is None:
            return
        device, ranges = self._gamepad
        await play_gamepad(
            device,
            Stick(ranges),
            hold=self.hold,
            stop=self.stop,
            wish=lambda wish: self._begin_wish(wish, screen),
            speed_rad_s=lambda: screen.speed_rad_s,
        )

    def _begin_wish(self, wish: PadWish, screen: ConsoleApp) -> None:
        self.touch()
        match wish:
            case PadWish.JUMP:
                self.jump()
            case PadWish.TAKE:
                self.take()
            case PadWish.RELEASE:
                self.release()
            case PadWish.STOP_ROBOT:
                screen.action_stop_robot()
            case PadWish.STOP_ALL:
                screen.action_stop_all()
            case _:
                assert_never(wish)

    @staticmethod
    async def _on_terminal(screen: ConsoleApp, console: Observer[Any]) -> None:
        """Run the screen; a terminal that goes away ends the console and with it the hold on the robot."""

        def gone() -> None:
            console.end("the terminal has gone away")
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

    # ------------------------------------------------------------------ what the screen asks for
    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture; see ``Session``."""
        frame, self._frame = self._frame, None
        if frame is not None:
            self._picture = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        return self._picture

    def now_s(self) -> float:
        """Return the mission time."""
        return self._console.clock.now_s() if self._console is not None else 0.0

    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down."""
        self._with_robot(lambda console: console.hold(drive, lasts_s))

    def stop(self) -> None:
        """Stop the wheels now."""
        self._with_robot(Teleoperation.stop)

    def jump(self) -> None:
        """Jump once."""
        self._with_robot(Teleoperation.jump)

    def take(self) -> None:
        """Ask for the robot."""
        self._with_robot(Teleoperation.take)

    def release(self) -> None:
        """Give the robot back."""
        self._with_robot(Teleoperation.begin_release)

    def ask_consent(self, why: str = "") -> None:
        """Ask the operator who holds the robot for it."""
        self._with_robot(lambda console: console.begin_ask_consent(why))

    def decide(self, is_given: bool) -> None:
        """Answer the operator who asks for the robot, or to lift a stop."""
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.decide(is_given)

    def require_let_go(self) -> None:
        """What is held moves nothing until it was let go and pressed anew."""
        self._with_robot(Teleoperation.require_let_go)

    def dismiss_lost(self) -> None:
        """The operator knows that a robot was lost."""
        self.model.dismiss_lost()

    async def switch(self, robot: str) -> None:
        """Give the robot back and ask for this one."""
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            await self._console.switch(robot)

    def touch(self) -> None:
        """Somebody is there."""
        self._with_robot(Teleoperation.touch)

    def leave(self) -> None:
        """Nobody is."""
        self._with_robot(Teleoperation.leave)

    def closed(self) -> None:
        """The screen has gone; the component gives the robot back, and ends."""
        if self._console is not None:
            self._console.end("the screen was closed")

    def acknowledge(self, key: str) -> None:
        """One alarm was seen, or all."""
        seen = self.model.acknowledge(key)
        if self._console is not None and self._console.state is LifeState.READY:
            self._console.acknowledged(seen, key)

    async def stop_robot(self, robot: str) -> bool:
        """Emergency stop of one robot."""
        return await self._ready_console().stop_robot(robot)

    async def stop_all(self) -> list[str]:
        """Emergency stop of all robots."""
        return await self._ready_console().stop_all()

    async def lift_stop(self, robot: str, number: int) -> bool:
        """Let the robot move again if those who stopped it let it; the number is that of the stop that was seen."""
        return await self._ready_console().lift_stop(robot, number)

    async def why(self, name: str) -> list[str]:
        """Return why it is as it is."""
        return await self._ready_console().why(name)

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        """Return what the mission's log has of this; see ``Session``."""
        console = self._ready_console()
        asked = question.asked(Now(self.now_s(), datetime.now(), console.clock.rate))
        return asked, await console.feed.search_log(asked)

    async def ask_parameters(self, name: str) -> bool:
        """Have its parameters told."""
        return await self._ready_console().feed.ask_parameters(name)

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        """Change one."""
        return await self._ready_console().set_parameter(name, parameter, value)

    def _with_robot(self, act: Callable[[Teleoperation], None]) -> None:
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            act(self._console)

    def _ready_console(self) -> Observer[Any]:
        if self._console is None:
            raise RuntimeError("the session does not run")
        return self._console
