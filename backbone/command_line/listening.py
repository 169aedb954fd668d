"""Shared parts of commands that listen to a mission until they are ended."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager

from backbone.bus.interface import Bus, Clock
from backbone.component.mission_time import MissionStart, ask_time
from backbone.errors import Refusal
from backbone.launcher.endings import say

GONE_AFTER_S = 5.0  # chosen: a restarted hub is back within two; seconds of the machine


class PortUnusable(Refusal):
    """The command cannot listen at this host and port."""

    code = "usage.port"
    remedy = "Name another port by --port, or an address of this machine by --host."


@contextmanager
def opening_port(host: str, port: int) -> Iterator[None]:
    """Open a port.

    Raises:
        PortUnusable: The port cannot be opened.
    """
    try:
        yield
    except (OSError, UnicodeError, RuntimeError) as error:  # by a host like 192.168..1; by Foxglove's library
        raise PortUnusable(f"cannot listen at {host}:{port}: {error}", host=host, port=port) from error


@contextmanager
def watching_end(bus: Bus, clock: Clock, ended: Callable[[str], None]) -> Iterator[None]:
    """Call a function with a line for people if, before the block's end, the mission ended or was started again.

    It has ended if its hub was away for ``GONE_AFTER_S``. If it is started again sooner, the link leads to a mission
    of the same name whose time the clock does not show.
    """
    loop = asyncio.get_running_loop()
    line = f"{bus.mission} has ended, or its hub cannot be reached"
    timer = loop.call_later(GONE_AFTER_S, ended, line)  # the hub may have left just now, and then no news comes
    comparing: asyncio.Task[None] | None = None
    start, was_away = MissionStart(), False

    async def compare_times() -> None:
        heard = await ask_time(bus, clock)
        if was_away and start.is_over(heard):
            ended(f"{bus.mission} was started again; repeat the command for the new mission")
        else:
            start.follow(heard, clock)

    def link_changed(is_up: bool) -> None:
        nonlocal timer, comparing, was_away
        timer.cancel()
        if not is_up:
            timer, was_away = loop.call_later(GONE_AFTER_S, ended, line), True
        elif comparing is None or comparing.done():
            comparing = loop.create_task(compare_times(), name="the mission's time")

    watching = bus.watch_link(link_changed)
    try:
        yield
    finally:
        watching.close()
        timer.cancel()
        if comparing is not None:
            comparing.cancel()


@asynccontextmanager
async def until_ended(bus: Bus, clock: Clock, for_s: float | None = None) -> AsyncIterator[asyncio.Event]:
    """Yield an event that is set by a signal, by a bug, or once the mission ended or was started again.

    Args:
        bus: Of the command; not closed.
        clock: Of the mission that the command shows.
        for_s: The event is set after so many seconds of the machine, too; None: not by time.

    Raises:
        BaseException: The bug.
    """
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    bugs: list[BaseException] = []

    def failed(bug: BaseException) -> None:
        bugs.append(bug)
        ended.set()

    def gone(line: str) -> None:
        say(line)
        ended.set()

    timer = loop.call_later(for_s, ended.set) if for_s is not None else None
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    bus.on_bug = failed
    try:
        with watching_end(bus, clock, gone):
            yield ended
    finally:
        if timer is not None:
            timer.cancel()
    if bugs:
        raise bugs[0]
