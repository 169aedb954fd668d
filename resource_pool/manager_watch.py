"""An ARC's watch over the RC manager: a restarted RC manager knows only the requests that it has collected."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus
from backbone.component.peer_monitor import PeerMonitor

ASKED_AGAIN_S = 1.0  # chosen: a restarted RC manager asks every ARC at once; after this time it has missed this ARC


class ManagerWatch:
    """Watches the RC manager for one ARC.

    Args:
        bus: For the RC manager's token.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._asked = asyncio.Event()
        self._manager: PeerMonitor | None = None

    @property
    def is_there(self) -> bool:
        """Whether an RC manager runs; False before ``watch``."""
        return self._manager is not None and self._manager.is_there

    def asks(self) -> None:
        """Record that the RC manager asked for the ARC's request."""
        self._asked.set()

    def request_changed(self) -> None:
        """Record a change of the request: an RC manager that has asked before, and still starts, may not get it."""
        self._asked.clear()

    async def watch(self, send_request: Callable[[], Awaitable[None]]) -> None:
        """Send the request again if a restarted RC manager has not asked for it since its last change."""
        manager = self._manager = PeerMonitor(self._bus, RC_MANAGER)
        try:
            await manager.wait_there()
            while True:
                self._asked.clear()
                await manager.wait_risen(manager.times_risen + 1)
                try:
                    async with asyncio.timeout(ASKED_AGAIN_S):
                        await self._asked.wait()
                except TimeoutError:
                    await send_request()
        finally:
            self._manager = None
            manager.close()
