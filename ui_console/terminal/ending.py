"""Begin and end of a terminal's screen: a crash keeps its exit code, and keys typed before the end are dropped."""

from __future__ import annotations

import asyncio
from typing import Any

from textual.app import App
from textual.events import Event, InputEvent, Load

from ui_console.terminal.driver import KeysDropped, TerminalDriver

DROPPED = "keys were dropped: this console stood still when they came, or no hand types as fast. Press anew."


class EndingApp(App[None]):
    """Base class of the consoles' screens."""

    _is_ending = False

    def get_driver_class(self) -> type[TerminalDriver]:
        """Return the driver of a terminal; a screen without one has Textual's headless driver."""
        return TerminalDriver

    def exit(self, result: None = None, return_code: int = 0, message: Any = None) -> None:
        """End; after a crash, keep the crash's exit code."""
        self._is_ending = True
        super().exit(result, return_code or self.return_code or 0, message)

    def on_load(self, _event: Load) -> None:
        """Let tasks begin in the loop's next round, on every Python.

        From Python 3.12 on, Textual lets all tasks of the process begin at once, for which ours are not written; and
        uvloop 0.23 cannot create such tasks on Python 3.13.0 to 3.13.2.
        """
        asyncio.get_running_loop().set_task_factory(None)

    def ask_terminal(self) -> None:
        """Ask the terminal for its cursor: a terminal that is still there answers by a ``CursorPosition``."""
        if isinstance(self._driver, TerminalDriver):
            self._driver.ask_position()

    def on_keys_dropped(self, _message: KeysDropped) -> None:
        """Say why the keys had no effect."""
        self.notify(DROPPED, severity="warning")

    async def on_event(self, event: Event) -> None:
        """Process an event; while the screen ends, drop keys and mouse events."""
        if not (self._is_ending and isinstance(event, InputEvent)):
            await super().on_event(event)
