"""Clocks: the only file that sleeps.

``MissionClock`` follows the machine's monotonic clock from the mission's start, at the mission's rate. ``VirtualLoop``
is an event loop with virtual time: when no callback is ready, it jumps to the next timer. So all sleeps and time-outs
of asyncio run on virtual time, in one process, as fast as the machine can and always in the same order. This loop runs
the work of threads itself: such work takes no virtual time, and its place in the order is fixed.
"""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from contextvars import Context
from typing import TypeVar, TypeVarTuple

from backbone.errors import BackboneError

LONG_WAIT_S = 0.1  # chosen: the system ends a shorter wait at most half a millisecond late
FIRST_SHARE = 0.95  # chosen: the rest is ten times as long as the system's delay
T = TypeVar("T")
Ts = TypeVarTuple("Ts")


class MissionClock:
    """Mission time on one machine.

    Args:
        origin_monotonic_s: Reading of the machine's monotonic clock at mission time 0.
        rate: Mission seconds per second of the machine, above 0.
    """

    def __init__(self, origin_monotonic_s: float, rate: float = 1.0) -> None:
        if not rate > 0:
            raise ValueError(f"rate must be above 0, not {rate}")
        self.origin_monotonic_s, self.rate = origin_monotonic_s, rate

    @classmethod
    def started_now(cls, rate: float = 1.0) -> MissionClock:
        """Return a clock whose mission begins now."""
        return cls(time.monotonic(), rate)

    def now_s(self) -> float:
        """Return the mission time in seconds."""
        return (time.monotonic() - self.origin_monotonic_s) * self.rate

    def set_to(self, at_s: float) -> None:
        """Show this mission time now. A wait that has begun stays as long as it is."""
        self.origin_monotonic_s = time.monotonic() - at_s / self.rate

    async def sleep_s(self, duration_s: float) -> None:
        """Return after this many mission seconds; at least yields once."""
        await asyncio.sleep(max(0.0, duration_s) / self.rate)

    async def sleep_until_s(self, at_s: float) -> None:
        """Return at this mission time, at once if it has passed."""
        await self.sleep_s(at_s - self.now_s())


class PunctualClock(MissionClock):
    """Mission time with waits of any length that end on time.

    Linux ends a wait late by up to a thousandth of its length, and by a two hundredth in a process with niceness
    (``select_estimate_accuracy`` in ``fs/select.c``): 15 ms after three seconds. So this clock splits a long wait into
    one that ends early and a short rest. Other clocks do not, because each further waking costs processor time.
    """

    async def sleep_until_s(self, at_s: float) -> None:
        """Return at this mission time, at once if it has passed."""
        while (left_s := (at_s - self.now_s()) / self.rate) > LONG_WAIT_S:
            await self.sleep_s(left_s * FIRST_SHARE * self.rate)
        await super().sleep_until_s(at_s)


class VirtualClock:
    """Mission time that is the time of the running event loop, which a ``VirtualLoop`` makes virtual."""

    _loop: asyncio.AbstractEventLoop | None = None

    @property
    def rate(self) -> float:
        """Always 1, because time-outs and mission time are the same."""
        return 1.0

    def now_s(self) -> float:
        """Return the loop's time in seconds."""
        loop = self._loop
        if loop is None or not loop.is_running():  # ``get_running_loop`` makes a system call
            loop = self._loop = asyncio.get_running_loop()
        return loop.time()

    async def sleep_s(self, duration_s: float) -> None:
        """Return after this many seconds of the loop; at least yields once."""
        await asyncio.sleep(max(0.0, duration_s))

    async def sleep_until_s(self, at_s: float) -> None:
        """Return at this time, at once if it has passed."""
        await asyncio.sleep(max(0.0, at_s - self.now_s()))


class NothingLeftToHappen(BackboneError):
    """Deadlock: all tasks wait, and no timer is set."""


class EndOfVirtualTime(BackboneError):
    """Virtual time has reached the end of its exact range."""


OWN_SOCKETS = 1  # asyncio's selector loops: the socket by which other threads wake the loop
RESOLUTION_S = time.get_clock_info("monotonic").resolution
LAST_VIRTUAL_S = 2.0**23  # 97 days; later, steps of a float are coarser than the loop's 1 ns and timers never expire


class _JumpingSelector(selectors.DefaultSelector):
    """Selects without waiting; instead of waiting it advances the loop's time."""

    now_s = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout == 0:  # callbacks are ready; sockets are looked at before time goes on
            return []
        # The loop's own socket only ends a wait in the system, and no time is spent there.
        has_sockets = len(self.get_map()) > OWN_SOCKETS
        if (has_sockets or timeout is None) and (ready := super().select(0)):
            return ready
        if timeout is None:
            raise NothingLeftToHappen(f"all tasks wait for ever at t={self.now_s:.6f} s")
        self.now_s += timeout
        if self.now_s > LAST_VIRTUAL_S:
            raise EndOfVirtualTime(f"virtual time ends at t={LAST_VIRTUAL_S:g} s")
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop whose time begins at 0 and jumps to the next timer when nothing else can run."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)

    def time(self) -> float:
        """Return the virtual time in seconds."""
        return self._jumping.now_s

    def call_at(
        self, when: float, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call the callback at this time; see ``asyncio.AbstractEventLoop.call_at``.

        A timer less than the loop's resolution away is due at once, and no time passes. A task that waits for the rest
        of a nanosecond would wait for ever, so this method rounds such a rest up to a time that passes.
        """
        now_s = self._jumping.now_s
        if now_s < when < now_s + RESOLUTION_S:
            when = now_s + 2 * RESOLUTION_S
        return super().call_at(when, callback, *args, context=context)

    def run_in_executor(
        self,
        executor: Executor | None,  # noqa: ARG002
        func: Callable[[*Ts], T],
        *args: *Ts,
    ) -> asyncio.Future[T]:
        """Run the function at once instead of in a thread; see ``asyncio.AbstractEventLoop.run_in_executor``.

        With a thread, time would jump past its unfinished work, and the order of events would depend on the machine.
        """
        future: asyncio.Future[T] = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:
            future.set_exception(error)
        return future


def run_virtual(main: Coroutine[object, None, T]) -> T:
    """Run the coroutine on a new ``VirtualLoop`` and return its result.

    Example:
        >>> async def hour() -> float:
        ...     await VirtualClock().sleep_s(3600.0)
        ...     return VirtualClock().now_s()
        >>> run_virtual(hour())
        3600.0
    """
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main)
