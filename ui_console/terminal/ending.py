"""How the screen of a terminal ends: what crashed stays a crash, and keys typed ahead of an end do nothing."""

from __future__ import annotations

from typing import Any

from textual.app import App
from textual.events import Event, InputEvent


class EndingApp(App[None]):
    """Base of the consoles' screen."""

    _is_ending = False

    def exit(self, result: None = None, return_code: int = 0, message: Any = None) -> None:
        """End; what ended by a crash keeps its code."""
        self._is_ending = True
        super().exit(result, return_code or self.return_code or 0, message)

    async def on_event(self, event: Event) -> None:
        """Take in what happens; once it ends, no key or mouse any more: they would meet no screen."""
        if not (self._is_ending and isinstance(event, InputEvent)):
            await super().on_event(event)
