"""News: wakes the tasks of the placer that wait for a change."""

from __future__ import annotations

import asyncio

from backbone.bus.interface import Clock
from backbone.waiting import first_of


class News:
    """Wakes all waiting tasks after an event of a component or a host."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._something_happened = asyncio.Event()

    def tell(self) -> None:
        """Wake all tasks that wait now."""
        self._something_happened.set()
        self._something_happened = asyncio.Event()

    async def or_at(self, at_s: float) -> None:
        """Return after the next event, or at this mission time."""
        await first_of(self._something_happened.wait(), self._clock.sleep_until_s(at_s))
