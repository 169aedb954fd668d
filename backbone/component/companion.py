"""Another component this one depends on: there, out of sight for a moment, or gone.

A liveliness token also falls when the link to the hub is cut, and comes back a moment later when its
component was restarted. Neither means that the other is gone for good; this file tells them apart.
"""

from __future__ import annotations

import asyncio

from backbone.bus.interface import Bus

GONE_AFTER_S = 1.0  # chosen: a restarted hub or component is back within half of it; machine seconds


class Companion:
    """Watches one component's liveliness token.

    Args:
        bus: Of the one who depends on it.
        address: Of the component.
        gone_after_s: Seconds of the machine, with the own link up, after which an absent one counts as gone.
    """

    def __init__(self, bus: Bus, address: str, *, gone_after_s: float = GONE_AFTER_S) -> None:
        self.address = address
        self._gone_after_s = gone_after_s
        self._token, self._link, self._risen = False, True, 0
        self._changed = asyncio.Event()
        self._declared = [bus.watch_link(self._link_changed), bus.watch_alive(address, self._token_changed)]

    @property
    def is_there(self) -> bool:
        """True while its token stands."""
        return self._token

    @property
    def times_risen(self) -> int:
        """How often its token was seen to rise."""
        return self._risen

    async def wait_there(self) -> None:
        """Return when its token stands, at once if it does."""
        while not self._token:
            await self._changed.wait()

    async def wait_hidden(self) -> None:
        """Return when its token does not stand, for whatever reason; at once if it does not."""
        while self._token:
            await self._changed.wait()

    async def wait_risen(self, times: int) -> None:
        """Return when its token was seen to rise this many times: the first is its being there at all."""
        while self._risen < times:
            await self._changed.wait()

    async def wait_gone(self) -> None:
        """Return when its token was missing for the whole of ``gone_after_s`` while the own link was up."""
        while True:
            changed = self._changed
            if self._token or not self._link:
                await changed.wait()
                continue
            try:
                async with asyncio.timeout(self._gone_after_s):
                    await changed.wait()
            except TimeoutError:
                return

    def close(self) -> None:
        """Stop watching."""
        for declared in self._declared:
            declared.close()

    def _token_changed(self, _address: str, alive: bool) -> None:
        self._token = alive
        self._risen += alive
        self._tell()

    def _link_changed(self, up: bool) -> None:
        self._link = up
        self._tell()

    def _tell(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()
