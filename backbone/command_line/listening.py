"""Shared parts of commands that serve other tools until a signal or the end of the mission."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager

from backbone.bus.interface import Bus
from backbone.errors import Refusal

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
async def until_ended(bus: Bus) -> AsyncIterator[asyncio.Event]:
    """Yield an event that is set by a signal, by a bug, or after the mission's hub was away for ``GONE_AFTER_S``.

    Raises:
        BaseException: The bug.
    """
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    gone: asyncio.TimerHandle | None = None
    bugs: list[BaseException] = []

    def failed(bug: BaseException) -> None:
        bugs.append(bug)
        ended.set()

    def link_changed(is_up: bool) -> None:
        nonlocal gone
        if gone is not None:
            gone.cancel()
        gone = None if is_up else loop.call_later(GONE_AFTER_S, ended.set)

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    bus.on_bug, watching = failed, bus.watch_link(link_changed)
    try:
        yield ended
    finally:
        watching.close()
        if gone is not None:
            gone.cancel()
    if bugs:
        raise bugs[0]
