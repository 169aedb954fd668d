"""A thread of its own for the rounds of one execution unit, beside the event loop of its component.

Between two rounds the unit belongs to the event loop, which takes values and decides when the next round begins, as it
does without a thread. During a round the unit belongs to the thread, and what arrives waits: of each key only the
newest value. So nothing is locked, and a module needs no care. On a ``VirtualLoop`` a round takes no time.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from backbone.bus.interface import Bus, Clock, current_cause
from backbone.keys import Conversation
from backbone.wire import Message
from mission_control.modules.execution_unit import ExecutionUnit, Produced
from mission_control.modules.os_threads import ThreadPlace, place_thread

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _Arrival:
    """The newest value of a key that waits for the end of a round, and how many it overwrote."""

    value: object
    cause: str
    overwritten: int = 0


class UnitThread:
    """The rounds of one unit in a thread.

    Args:
        produced: Called in the event loop with the time of each round and what its modules produced.
    """

    def __init__(self, unit: ExecutionUnit, clock: Clock, produced: Callable[[float, list[Produced]], None]) -> None:
        self._unit, self._clock, self._produced = unit, clock, produced
        self._pool = ThreadPoolExecutor(1, thread_name_prefix=unit.name)
        self._arrived: dict[str, _Arrival] = {}
        self._news = asyncio.Event()

    async def place(self, nice: int, cpus: list[int]) -> ThreadPlace | None:
        """Place the thread; return None on a ``VirtualLoop``, which has none.

        Raises:
            ThreadRefused: It cannot run there.
        """
        return await self._in_thread(
            lambda: None if threading.current_thread() is threading.main_thread() else place_thread(nice, cpus)
        )

    def put(self, key: str, value: object) -> None:
        """Take a value from outside the unit, at once or after the round that runs."""
        older = self._arrived.get(key)
        self._arrived[key] = _Arrival(value, current_cause.get(), 0 if older is None else older.overwritten + 1)
        self._news.set()

    async def keep(self) -> None:
        """Have all rounds, until cancelled; the round that then runs ends by itself, and nobody gets its outputs."""
        try:
            while True:
                await self._wait()
                if self._unit.tick(self._clock.now_s()):
                    current_cause.set("")
                    await self._round()
                if self._arrived:
                    key, arrival = next(iter(self._arrived.items()))
                    del self._arrived[key]
                    if self._unit.put(key, arrival.value, arrival.overwritten):
                        current_cause.set(arrival.cause)
                        await self._round()
        finally:
            self._pool.shutdown(wait=False, cancel_futures=True)

    async def _wait(self) -> None:
        """Return when a round is due because of the time, or a value waits."""
        self._news.clear()
        if self._arrived:
            return
        left_s = (self._unit.due_s - self._clock.now_s()) / self._clock.rate
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(None if left_s == math.inf else left_s):
                await self._news.wait()

    async def _round(self) -> None:
        now_s = self._clock.now_s()
        self._produced(now_s, await self._in_thread(lambda: self._unit.run(now_s)))

    async def _in_thread(self, act: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._pool, act)


class LoopPublisher:
    """Publishes from any thread: the event loop sends."""

    def __init__(self, bus: Bus) -> None:
        self._bus, self._loop = bus, asyncio.get_running_loop()

    @property
    def source(self) -> str:
        """Address of the component."""
        return self._bus.source

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message soon; nothing happens when the loop has ended."""
        with contextlib.suppress(RuntimeError):  # a round may end after the component and its loop
            self._loop.call_soon_threadsafe(self._bus.publish, address, conversation, message)
