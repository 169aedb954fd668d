"""A peer monitor distinguishes a peer that is gone from a hidden one."""

from __future__ import annotations

import asyncio
from typing import Any

from backbone.bus.clock import run_virtual
from backbone.component.peer_monitor import GONE_AFTER_S, PeerMonitor


class ScriptedBus:
    """A bus whose tokens and link the test sets."""

    def __init__(self) -> None:
        self.token: Any = None
        self.link: Any = None

    def watch_alive(self, address: str, listener: Any) -> ScriptedBus:
        self.token = lambda alive: listener(address, alive)
        return self

    def watch_link(self, listener: Any) -> ScriptedBus:
        self.link = listener
        return self

    def close(self) -> None:
        self.token = self.link = None


async def when_gone(bus: ScriptedBus, *, until_s: float) -> float | None:
    """Return when the peer counted as gone, or None if it did not by then."""
    loop = asyncio.get_running_loop()
    monitor = PeerMonitor(bus, "resource_pool/arc")  # type: ignore[arg-type]
    try:
        async with asyncio.timeout_at(until_s):
            await monitor.wait_gone()
    except TimeoutError:
        return None
    finally:
        monitor.close()
    return loop.time()


def play(*events: tuple[float, str, bool]) -> float | None:
    async def main() -> float | None:
        bus = ScriptedBus()
        loop = asyncio.get_running_loop()
        for at_s, what, value in events:
            loop.call_at(at_s, lambda what=what, value=value: getattr(bus, what)(value))
        return await when_gone(bus, until_s=60.0)

    return run_virtual(main())


def test_one_whose_token_stands_is_not_gone() -> None:
    assert play((0.1, "token", True)) is None


def test_one_whose_token_fell_is_gone_after_the_grace() -> None:
    assert play((0.1, "token", True), (5.0, "token", False)) == 5.0 + GONE_AFTER_S


def test_one_that_was_never_there_is_gone_after_the_grace() -> None:
    assert play() == GONE_AFTER_S


def test_one_that_came_back_within_the_grace_is_not_gone() -> None:
    assert play((0.1, "token", True), (5.0, "token", False), (5.0 + 0.9 * GONE_AFTER_S, "token", True)) is None


def test_while_the_own_link_is_down_nobody_counts_as_gone() -> None:
    assert play((0.1, "token", True), (5.0, "token", False), (5.01, "link", False)) is None


def test_the_grace_begins_when_the_link_is_back() -> None:
    events = [(0.1, "token", True), (5.0, "link", False), (5.01, "token", False), (9.0, "link", True)]
    assert play(*events) == 9.0 + GONE_AFTER_S


def test_every_rise_of_the_token_is_noticed_also_between_two_looks() -> None:
    async def main() -> int:
        bus = ScriptedBus()
        monitor = PeerMonitor(bus, "resource_pool/arc")  # type: ignore[arg-type]
        bus.token(True)
        waiting = asyncio.create_task(monitor.wait_risen(2))
        await asyncio.sleep(0)
        bus.token(False)
        bus.token(True)
        await waiting
        return monitor.times_risen

    assert run_virtual(main()) == 2
