"""News: wakes the tasks of the placer that wait for a change."""

from __future__ import annotations

import asyncio

from backbone.bus.interface import Clock


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
        news = asyncio.ensure_future(self._something_happened.wait())
        time = asyncio.ensure_future(self._clock.sleep_until_s(at_s))
        try:
            await asyncio.wait({news, time}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            news.cancel()
            time.cancel()
            await asyncio.gather(news, time, return_exceptions=True)
