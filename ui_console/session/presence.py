"""Whether somebody is at a console: what they touch says so, and a long silence that nobody is."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from backbone.waiting import set_within
from ui_console.model.events import Attention

if TYPE_CHECKING:
    from ui_console.session.observer import Observer


class Presence:
    """Tells when the operator turns away and comes back.

    Args:
        console: At which they sit.
    """

    def __init__(self, console: Observer[Any]) -> None:
        self._console = console
        self._touched = asyncio.Event()
        self._is_there = True

    def touch(self) -> None:
        """The operator is there."""
        self._tell(True)
        self._touched.set()

    def leave(self) -> None:
        """The operator turned away."""
        self._tell(False)

    async def run(self, away_after_s: float, away: Callable[[], Awaitable[None]]) -> None:
        """Call ``away`` whenever nothing was touched for so long, machine seconds; until cancelled."""
        while True:
            self._touched.clear()
            if not await set_within(self._touched, away_after_s):
                await away()
                await self._touched.wait()

    def _tell(self, is_there: bool) -> None:
        if is_there is not self._is_there:
            self._is_there = is_there
            self._console.show(Attention(self._console.clock.now_s(), is_there))
