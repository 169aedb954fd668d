"""A separate thread for the rounds of one execution unit, beside the event loop of its component.

The thread decides when the next round begins. So the unit keeps its rate even if the event loop is blocked, by another
component of the process or by a hub that hangs. The event loop puts values in and publishes outputs. If a value arrives
while the unit waits, a round begins; of the values that arrive during a round, only the newest of each key waits. The
outputs of up to ``MOST_WAITING`` rounds wait for the event loop. On a ``VirtualLoop`` there is no thread, and a round
takes no time.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from backbone.bus.clock import VirtualLoop
from backbone.bus.interface import Bus, Clock, current_cause
from backbone.keys import Conversation
from backbone.wire import Message
from mission_control.modules.execution_unit import ExecutionUnit, Produced
from mission_control.modules.os_threads import ThreadPlace, place_thread

MOST_WAITING = 256  # chosen: a hub that hangs blocks a sender for a second; few units have more rounds in that time
LONGEST_WAIT_S = 3600.0  # chosen: far below the longest wait of a lock


@dataclass(frozen=True, slots=True)
class _Arrival:
    """The newest value of a key that waits for the end of a round, and the number of values that it replaced."""

    key: str
    value: object
    cause: str
    overwritten: int = 0


@dataclass(frozen=True, slots=True)
class _Round:
    """A round whose outputs wait for the event loop."""

    now_s: float
    cause: str
    produced: list[Produced]


class UnitThread:
    """The rounds of one unit in a thread. Create it inside the event loop of its component.

    Args:
        produced: Called in the event loop with the time of each round and the produced values.
        failed: Called in the event loop with an exception of ``produced``.

    Attributes:
        lost: Number of rounds whose outputs were dropped, because too many waited for the event loop.
    """

    def __init__(
        self,
        unit: ExecutionUnit,
        clock: Clock,
        produced: Callable[[float, list[Produced]], None],
        failed: Callable[[BaseException], None],
    ) -> None:
        self._unit, self._clock, self._produced, self._failed = unit, clock, produced, failed
        self._loop = asyncio.get_running_loop()
        self._pool: ThreadPoolExecutor | None = None
        if not isinstance(self._loop, VirtualLoop):
            self._pool = ThreadPoolExecutor(1, thread_name_prefix=unit.name)
        self._news, self._virtual_news = threading.Condition(), asyncio.Event()
        self._arrived: dict[str, _Arrival] = {}
        self._next: _Arrival | None = None
        self._is_idle = False
        self._waiting: deque[_Round] = deque()
        self._is_over = False
        self.lost = 0

    async def place(self, nice: int, cpus: list[int]) -> ThreadPlace | None:
        """Set the thread's niceness and processors; return None on a ``VirtualLoop``, because it has no thread.

        Raises:
            ThreadRefused: The operating system refuses the values.
        """
        if self._pool is None:
            return None
        return await self._loop.run_in_executor(self._pool, place_thread, nice, cpus)

    def put(self, key: str, value: object) -> None:
        """Store a value from outside the unit, at once or after the present round; call it in the event loop."""
        cause = current_cause.get()
        with self._news:
            if self._is_idle and self._next is None:
                self._next = _Arrival(key, value, cause)
            else:
                older = self._arrived.get(key)
                self._arrived[key] = _Arrival(key, value, cause, 0 if older is None else older.overwritten + 1)
            self._news.notify()
        self._virtual_news.set()

    async def keep(self) -> None:
        """Run all rounds until cancelled; a round in progress then ends by itself, and its outputs are dropped."""
        try:
            if self._pool is None:
                await self._live_virtually()
            else:
                await self._loop.run_in_executor(self._pool, self._live)
        finally:
            with self._news:
                self._is_over = True
                self._news.notify()
            if self._pool is not None:
                self._pool.shutdown(wait=False, cancel_futures=True)

    def _live(self) -> None:
        while not self._is_over:
            with self._news:
                self._is_idle = not (self._arrived or self._is_over)
                if self._is_idle:
                    self._news.wait(max(0.0, min(self._left_s, LONGEST_WAIT_S)))
                self._is_idle = False
            self._turn()

    async def _live_virtually(self) -> None:
        while True:
            self._virtual_news.clear()
            if not self._arrived:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(None if self._left_s == math.inf else self._left_s):
                        await self._virtual_news.wait()
            self._turn()

    @property
    def _left_s(self) -> float:
        """Machine seconds until the next round of the frequency."""
        return (self._unit.due_s - self._clock.now_s()) / self._clock.rate

    def _turn(self) -> None:
        """Run the round that is due because of the time, and the round for waiting values."""
        if self._unit.tick(self._clock.now_s()):
            self._round("")
        with self._news:
            arrival, self._next = self._next, None
            if arrival is None and self._arrived:
                arrival = self._arrived.pop(next(iter(self._arrived)))
        if arrival is not None and self._unit.put(arrival.key, arrival.value, arrival.overwritten):
            self._round(arrival.cause)

    def _round(self, cause: str) -> None:
        now_s = self._clock.now_s()
        done = _Round(now_s, cause, self._unit.run(now_s))
        if self._pool is None:
            self._hand_on(done)
            return
        with self._news:
            is_first = not self._waiting
            self._waiting.append(done)
            if len(self._waiting) > MOST_WAITING:
                self._waiting.popleft()
                self.lost += 1
        if is_first:
            with contextlib.suppress(RuntimeError):  # the component and its loop have ended
                self._loop.call_soon_threadsafe(self._hand_next_on)

    def _hand_next_on(self) -> None:
        """Pass the outputs of one round on; the next round follows in a separate step, so that listeners get both."""
        with self._news:
            done, has_more = self._waiting.popleft(), len(self._waiting) > 0
        try:
            self._hand_on(done)
        except Exception as bug:  # the event loop would only log it
            self._failed(bug)
        if has_more:
            self._loop.call_soon(self._hand_next_on)

    def _hand_on(self, done: _Round) -> None:
        if not self._is_over:
            current_cause.set(done.cause)
            self._produced(done.now_s, done.produced)


class LoopPublisher:
    """Publishes from any thread, through the event loop."""

    def __init__(self, bus: Bus) -> None:
        self._bus, self._loop = bus, asyncio.get_running_loop()

    @property
    def source(self) -> str:
        """Address of the component."""
        return self._bus.source

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message soon; if the loop has ended, do nothing."""
        with contextlib.suppress(RuntimeError):  # a round may end later than the component and its loop
            self._loop.call_soon_threadsafe(self._bus.publish, address, conversation, message)
