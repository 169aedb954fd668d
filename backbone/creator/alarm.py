"""Alarm: wakes a keeper of processes at the time that its last decision named."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Coroutine

from backbone.bus.interface import Clock


class Alarm:
    """Rings once at the time that was set last; each later time replaces the former one.

    Args:
        clock: Times are in seconds of the machine.
        task: Runs work under a name; the caller cancels it at the end.
        ring: Called at the time; may set the next one.
    """

    def __init__(
        self,
        clock: Clock,
        task: Callable[[Coroutine[object, None, None], str], asyncio.Task[None]],
        ring: Callable[[], None],
        name: str,
    ) -> None:
        self._clock, self._task, self._ring, self._name = clock, task, ring, name
        self._waiting: asyncio.Task[None] | None = None
        self._at_s = math.inf

    def set(self, at_s: float) -> None:
        """Ring at this time."""
        if self._waiting is not None and self._waiting is not asyncio.current_task():
            if self._at_s == at_s and not self._waiting.done():
                return
            self._waiting.cancel()
        self._at_s = at_s
        self._waiting = self._task(self._wait(at_s), self._name)

    async def _wait(self, at_s: float) -> None:
        await self._clock.sleep_until_s(at_s * self._clock.rate)
        self._ring()
