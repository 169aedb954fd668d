"""Presence of a console's operator: an action shows presence, a long inactivity shows absence."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from backbone.waiting import set_within
from ui_console.model.events import Attention

if TYPE_CHECKING:
    from ui_console.session.observer import AnyObserver


class OperatorPresence:
    """Shows when the operator leaves and returns."""

    def __init__(self, console: AnyObserver) -> None:
        self._console = console
        self._touched = asyncio.Event()
        self._is_there = True

    def touch(self) -> None:
        """Record that the operator is there."""
        self._show(True)
        self._touched.set()

    def leave(self) -> None:
        """Record that the operator turned away."""
        self._show(False)

    async def run(self, away_after_s: float, away: Callable[[], Awaitable[None]]) -> None:
        """Call ``away`` after this number of machine seconds without an action, repeatedly, until cancelled."""
        while True:
            self._touched.clear()
            if not await set_within(self._touched, away_after_s):
                await away()
                await self._touched.wait()

    def _show(self, is_there: bool) -> None:
        if is_there is not self._is_there:
            self._is_there = is_there
            self._console.show(Attention(self._console.clock.now_s(), is_there))
