"""Laws of the clocks: virtual time is exact, ordered, repeatable, and finds deadlocks at once."""

from __future__ import annotations

import asyncio
import math
import random
import socket
import threading
import time
from collections.abc import Coroutine
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import (
    LAST_VIRTUAL_S,
    EndOfVirtualTime,
    MissionClock,
    NothingLeftToHappen,
    PunctualClock,
    VirtualClock,
    VirtualLoop,
    run_virtual,
)

durations = st.lists(st.floats(0.0, 1e6), min_size=1, max_size=20)


async def woken_in_order(durations_s: list[float]) -> list[tuple[float, int]]:
    clock, woken = VirtualClock(), []

    async def sleeper(number: int, duration_s: float) -> None:
        await clock.sleep_s(duration_s)
        woken.append((clock.now_s(), number))

    async with asyncio.TaskGroup() as sleepers:
        for number, duration_s in enumerate(durations_s):
            sleepers.create_task(sleeper(number, duration_s))
    return woken


@pytest.mark.virtual_limit(2e6)
@given(durations)
def test_sleepers_wake_in_order_of_time_and_never_early(durations_s: list[float]) -> None:
    woken = run_virtual(woken_in_order(durations_s))
    assert [at_s for at_s, _ in woken] == sorted(at_s for at_s, _ in woken)
    for at_s, number in woken:
        assert at_s == pytest.approx(durations_s[number], abs=1e-8)
        assert at_s >= durations_s[number] - 1e-8


@pytest.mark.virtual_limit(2e6)
@given(durations)
def test_the_same_program_gives_the_same_run(durations_s: list[float]) -> None:
    assert run_virtual(woken_in_order(durations_s)) == run_virtual(woken_in_order(durations_s))


def test_a_run_of_many_tasks_repeats_itself_from_its_seed() -> None:
    async def market(seed: int) -> list[tuple[float, int]]:
        dice, clock = random.Random(seed), VirtualClock()
        stock: asyncio.Queue[int] = asyncio.Queue(maxsize=3)
        sold: list[tuple[float, int]] = []

        async def produce(first: int) -> None:
            for item in range(first, first + 20):
                await clock.sleep_s(dice.random())
                await stock.put(item)

        async def consume() -> None:
            while len(sold) < 60:
                item = await stock.get()
                await clock.sleep_s(dice.random() / 2)
                sold.append((clock.now_s(), item))

        consumer = asyncio.create_task(consume())
        await asyncio.gather(*(produce(first) for first in (0, 100, 200)))
        await consumer
        return sold

    assert run_virtual(market(7)) == run_virtual(market(7))
    assert run_virtual(market(7)) != run_virtual(market(8))


@pytest.mark.virtual_limit(2e6)
def test_a_day_takes_no_time_and_is_exact() -> None:
    async def days() -> float:
        for _ in range(3):
            await VirtualClock().sleep_s(86_400.0)
        return VirtualClock().now_s()

    began_s = time.monotonic()
    assert run_virtual(days()) == 3 * 86_400.0
    assert time.monotonic() - began_s < 5.0, "virtual days took real time"


@pytest.mark.virtual_limit(LAST_VIRTUAL_S)
def test_late_in_virtual_time_each_timer_still_comes_and_then_time_ends() -> None:
    """A float's step grows with time; past the loop's resolution of 1 ns a timer would be waited for for ever."""
    reached: list[float] = []

    async def late() -> None:
        clock = VirtualClock()
        await clock.sleep_until_s(LAST_VIRTUAL_S - 1.0)
        for _ in range(100):
            await clock.sleep_s(1e-8)
        reached.append(clock.now_s())
        await clock.sleep_s(10.0)

    with pytest.raises(EndOfVirtualTime):
        run_virtual(late())
    assert reached == [pytest.approx(LAST_VIRTUAL_S - 1.0 + 1e-6, abs=1e-7)]


def test_time_outs_are_virtual() -> None:
    async def impatient() -> float:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(600.0):
                await asyncio.Event().wait()
        return VirtualClock().now_s()

    assert run_virtual(impatient()) == 600.0


def test_a_deadlock_is_found_at_once() -> None:
    async def deadlock() -> None:
        await VirtualClock().sleep_s(2.5)
        await asyncio.Event().wait()

    began_s = time.monotonic()
    with pytest.raises(NothingLeftToHappen, match=r"at t=2\.500000 s"):
        run_virtual(deadlock())
    assert time.monotonic() - began_s < 5.0, "a deadlock was waited for"


def test_a_deadlock_of_a_helper_is_no_deadlock_while_a_timer_runs() -> None:
    async def main() -> float:
        waiting = asyncio.create_task(asyncio.Event().wait())
        await VirtualClock().sleep_s(1.0)
        waiting.cancel()
        await asyncio.wait({waiting})
        return VirtualClock().now_s()

    assert run_virtual(main()) == 1.0


def test_an_exception_leaves_the_virtual_loop_unchanged() -> None:
    async def fails() -> None:
        await VirtualClock().sleep_s(1.0)
        raise KeyError("x")

    with pytest.raises(KeyError):
        run_virtual(fails())


def test_each_virtual_loop_begins_at_zero() -> None:
    async def now_s() -> float:
        return VirtualClock().now_s()

    assert run_virtual(now_s()) == run_virtual(now_s()) == 0.0
    assert VirtualClock().rate == 1.0


@pytest.mark.parametrize("until_s", [-5.0, 0.0])
def test_sleeping_until_the_past_only_yields(until_s: float) -> None:
    async def main() -> list[str]:
        order: list[str] = []
        other = asyncio.create_task(note(order, "other"))
        await VirtualClock().sleep_until_s(until_s)
        order.append("sleeper")
        await other
        assert VirtualClock().now_s() == 0.0
        return order

    assert run_virtual(main()) == ["other", "sleeper"]


async def note(order: list[str], what: str) -> None:
    order.append(what)


def on_virtual_loop(main: Coroutine[Any, Any, None]) -> None:
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(main)


@pytest.mark.parametrize("rate", [0.25, 1.0, 50.0])
def test_a_mission_clock_runs_at_its_rate(rate: float) -> None:
    clock = MissionClock(time.monotonic() - 2.0, rate)
    before_s = (time.monotonic() - clock.origin_monotonic_s) * rate
    now_s = clock.now_s()
    assert before_s <= now_s <= (time.monotonic() - clock.origin_monotonic_s) * rate
    assert clock.rate == rate
    assert now_s >= 2.0 * rate


@pytest.mark.parametrize("rate", [0.25, 1.0, 50.0])
def test_a_mission_clock_sleeps_the_longer_the_slower_it_runs(rate: float) -> None:
    async def main() -> None:
        clock = MissionClock(0.0, rate)
        began_s = VirtualClock().now_s()
        await clock.sleep_s(10.0)
        assert VirtualClock().now_s() - began_s == pytest.approx(10.0 / rate)

    on_virtual_loop(main())


def test_a_mission_clock_started_now_begins_at_zero() -> None:
    clock = MissionClock.started_now(rate=2.0)
    assert 0.0 <= clock.now_s() < 2.0
    assert clock.rate == 2.0


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_time_that_does_not_move_on_is_refused(rate: float) -> None:
    with pytest.raises(ValueError, match="rate must be above 0"):
        MissionClock(0.0, rate)


@pytest.mark.virtual_limit(2e6)
@given(st.floats(1e-3, 1e6))
def test_whoever_is_woken_a_rounding_early_works_and_waits_for_the_rest_gets_there(at_s: float) -> None:
    """While anything can run the loop takes timers within its resolution for due and lets no time pass."""

    async def main() -> None:
        clock = VirtualClock()
        early = asyncio.create_task(clock.sleep_until_s(math.nextafter(at_s, 0.0)))
        trials = 0
        while clock.now_s() < at_s:
            work = asyncio.create_task(asyncio.sleep(0))
            await clock.sleep_until_s(at_s)
            await work
            trials += 1
            assert trials < 4
        assert clock.now_s() <= at_s + 1e-8
        await early

    run_virtual(main())


def test_work_for_a_thread_is_done_by_the_virtual_loop_in_order_and_takes_no_time() -> None:
    async def main() -> None:
        done: list[str] = []

        async def hand_over(name: str) -> None:
            await asyncio.to_thread(done.append, name)
            assert VirtualClock().now_s() == 0.0

        await asyncio.gather(*map(hand_over, "abcdef"))
        assert done == list("abcdef")
        with pytest.raises(ZeroDivisionError):
            await asyncio.get_running_loop().run_in_executor(None, divmod, 1, 0)

    run_virtual(main())


@given(wait_s=st.floats(0.0, 3600.0), rate=st.sampled_from([0.1, 1.0, 10.0]))
def test_a_punctual_clock_returns_in_time_although_the_system_wakes_it_late(wait_s: float, rate: float) -> None:
    now_s = [100.0]

    async def sleep(duration_s: float) -> None:
        now_s[0] += duration_s * (1 + 1 / 200)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("backbone.bus.clock.time.monotonic", lambda: now_s[0])
        patched.setattr("backbone.bus.clock.asyncio.sleep", sleep)
        waiting = PunctualClock(100.0, rate).sleep_until_s(wait_s * rate)
        with pytest.raises(StopIteration):
            waiting.send(None)
    assert 100.0 + wait_s - 1e-9 <= now_s[0] <= 100.0 + wait_s + 0.001


def test_a_clock_shows_the_time_of_the_loop_that_runs_now() -> None:
    clock = VirtualClock()

    async def after(wait_s: float) -> float:
        await clock.sleep_s(wait_s)
        return clock.now_s()

    assert [run_virtual(after(wait_s)) for wait_s in (5.0, 2.0)] == [5.0, 2.0]
    with pytest.raises(RuntimeError):
        clock.now_s()


def test_a_socket_is_heard_before_time_goes_on() -> None:
    async def main() -> tuple[bytes, float]:
        here, there = socket.socketpair()
        with here, there:
            here.setblocking(False)
            there.send(b"now")
            heard = await asyncio.get_running_loop().sock_recv(here, 10)
            waiting = asyncio.create_task(asyncio.get_running_loop().sock_recv(here, 10))
            asyncio.get_running_loop().call_later(1.0, there.send, b"later")
            await asyncio.sleep(1.5)
            return heard + waiting.result(), VirtualClock().now_s()

    assert run_virtual(main()) == (b"nowlater", 1.5)


def test_a_deadlock_is_none_while_another_thread_may_wake_the_loop() -> None:
    async def main() -> None:
        loop, woken = asyncio.get_running_loop(), asyncio.Event()
        thread = threading.Thread(target=loop.call_soon_threadsafe, args=(woken.set,))
        thread.start()
        thread.join()
        await woken.wait()

    run_virtual(main())
