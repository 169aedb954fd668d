"""Peer monitor: whether a component on which this one depends is present, hidden for a moment, or gone.

A liveliness token also ends when the link to the hub is cut, and a restarted component declares its token again
within moments. In both cases the peer is hidden, not gone.
"""

from __future__ import annotations

import asyncio

from backbone.bus.interface import Bus
from backbone.waiting import set_within

GONE_AFTER_S = 1.0  # chosen: a restarted hub or component is back within half of it; machine seconds


class PeerMonitor:
    """Watches the liveliness token of one peer.

    Args:
        gone_after_s: Seconds of the machine, with the own link up, after which an absent peer counts as gone.
    """

    def __init__(self, bus: Bus, address: str, *, gone_after_s: float = GONE_AFTER_S) -> None:
        self.address = address
        self._gone_after_s = gone_after_s
        self.is_there = False
        """True while the token exists."""
        self.times_risen = 0
        """How often the token has appeared."""
        self._link = True
        self._changed = asyncio.Event()
        self._declared = [bus.watch_link(self._link_changed), bus.watch_alive(address, self._token_changed)]

    async def wait_there(self) -> None:
        """Return when the token exists."""
        while not self.is_there:
            await self._changed.wait()

    async def wait_hidden(self) -> None:
        """Return when the token does not exist."""
        while self.is_there:
            await self._changed.wait()

    async def wait_risen(self, times: int) -> None:
        """Return when the token has appeared ``times`` times; the first time counts."""
        while self.times_risen < times:
            await self._changed.wait()

    async def wait_gone(self) -> None:
        """Return when the token was missing for the whole of ``gone_after_s`` while the own link was up."""
        while True:
            changed = self._changed
            if self.is_there or not self._link:
                await changed.wait()
            elif not await set_within(changed, self._gone_after_s):
                return

    def close(self) -> None:
        """Stop watching."""
        for declared in self._declared:
            declared.close()

    def _token_changed(self, _address: str, alive: bool) -> None:
        self.is_there = alive
        self.times_risen += alive
        self._wake_waiting()

    def _link_changed(self, up: bool) -> None:
        self._link = up
        self._wake_waiting()

    def _wake_waiting(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()
