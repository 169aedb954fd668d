"""A console's screen and its component, in one event loop."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
from numpy.typing import NDArray
from textual import pilot as textual_pilot

from resource_pool.arc_client import Frame
from ui_console.console_events import ConsoleEvent
from ui_console.console_model import ConsoleModel
from ui_console.driving import Drive
from ui_console.observer import Observer
from ui_console.teleoperation import Teleoperation
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.hangup import HangupWatch

Pilot = Callable[[textual_pilot.Pilot[Any]], Coroutine[Any, Any, None]]


class TerminalSession:
    """Hands what a component hears to the model, and what keys want to the component.

    Args:
        name: Name of the console.
    """

    def __init__(self, name: str) -> None:
        self.model = ConsoleModel(name)
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
    ) -> None:
        """Show the screen until a key or the component ends it; both have ended afterwards.

        Args:
            console: The component.
            pilot: Presses the keys, on a screen nobody sees, in place of a person at a terminal.
            size: Columns and lines of the pilot's screen.

        Raises:
            BaseException: What ended the component, if that was a bug or a refusal.
        """
        self._console = console
        screen = ConsoleApp(self, drives=isinstance(console, Teleoperation))
        living = asyncio.create_task(console.run(), name="console")
        living.add_done_callback(lambda _living: screen.exit())
        try:
            if pilot is None:
                await self._on_terminal(screen, console)
            else:
                await screen.run_async(headless=True, size=size, auto_pilot=pilot)
        finally:
            console.end("the screen was closed")
            await living

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

    def hold(self, drive: Drive) -> None:
        """A drive key is down."""
        self._with_robot(lambda console: console.hold(drive))

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

    def _with_robot(self, act: Callable[[Teleoperation], None]) -> None:
        if isinstance(self._console, Teleoperation) and self._console.is_ready:
            act(self._console)
