"""Shared parts of commands that listen to a mission until they are ended."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

from backbone.bus.interface import Bus
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
    except (OSError, RuntimeError) as error:  # the latter by Foxglove's library
        raise PortUnusable(f"cannot listen at {host}:{port}: {error}", host=host, port=port) from error


@asynccontextmanager
async def until_ended(bus: Bus, for_s: float | None = None) -> AsyncIterator[asyncio.Event]:
    """Yield an event that is set by a signal, by a bug, or once the mission's hub was away for ``GONE_AFTER_S``.

    Args:
        bus: Of the command; not closed.
        for_s: The event is set after so many seconds of the machine, too; None: not by time.

    Raises:
        BaseException: The bug.
    """
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    bugs: list[BaseException] = []

    def failed(bug: BaseException) -> None:
        bugs.append(bug)
        ended.set()

    def gone() -> None:
        say(f"{bus.mission} has ended, or its hub cannot be reached")
        ended.set()

    timers = {"gone": loop.call_later(GONE_AFTER_S, gone)}  # the hub may have left just now, and then no news comes
    if for_s is not None:
        timers["for"] = loop.call_later(for_s, ended.set)

    def link_changed(is_up: bool) -> None:
        timers["gone"].cancel()
        if not is_up:
            timers["gone"] = loop.call_later(GONE_AFTER_S, gone)

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    bus.on_bug, watching = failed, bus.watch_link(link_changed)
    try:
        yield ended
    finally:
        watching.close()
        for timer in timers.values():
            timer.cancel()
    if bugs:
        raise bugs[0]
