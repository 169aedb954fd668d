"""Notices of an ARC to its owner, one after the other, each repeated until it is noted or outdated."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass

from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError, Refusal
from resource_pool.messages import Noted, Resumed, Suspended, Suspending

NOTICE_S = 1.0  # chosen: an owner that needs longer misses its heartbeat, too
NOTICE_AGAIN_S = 0.1  # chosen: a restarted hub is reachable again after a few attempts; machine seconds


@dataclass(frozen=True, slots=True)
class _Notice:
    """A notice to the owner, the time limit of its answer (machine seconds), and the event of its end."""

    notice: Resumed | Suspending | Suspended
    within_s: float
    done: asyncio.Event


class OwnerNotices:
    """Queue of notices to the owner."""

    def __init__(self, bus: Bus, clock: Clock, owner: str, note: Callable[[str, str], object]) -> None:
        """Create an empty queue.

        Args:
            owner: Address of the decision process.
            note: Subject, event → the story.
        """
        self._bus, self._clock, self._owner, self._note = bus, clock, owner, note
        self._waiting: asyncio.Queue[_Notice] = asyncio.Queue()

    def notify(self, notice: Resumed | Suspending | Suspended, within_s: float = NOTICE_S) -> asyncio.Event:
        """Queue a notice after all earlier ones; the event is set when the owner noted it or the limit expired."""
        noted = asyncio.Event()
        self._waiting.put_nowait(_Notice(notice, within_s, noted))
        return noted

    async def send(self) -> None:
        """Send the notices one at a time, so that no notice overtakes another on its way to a slow owner."""
        while True:
            waiting = await self._waiting.get()
            await self._send_until_noted(waiting)
            waiting.done.set()

    async def _send_until_noted(self, waiting: _Notice) -> None:
        """Repeat a notice, which may get lost, until the owner notes it or a newer notice waits.

        Other checks detect an owner that hangs or is gone.
        """
        while True:
            try:
                await self._bus.ask(self._owner, waiting.notice, Noted, within_s=waiting.within_s)
                return
            except Refusal as refusal:
                self._note(self._owner, f"did not note {type(waiting.notice).__name__}: {refusal}")
                return
            except LinkError as error:
                self._note(self._owner, f"did not note {type(waiting.notice).__name__}: {error}")
            if isinstance(waiting.notice, Suspending) or not self._waiting.empty():
                return
            await self._clock.sleep_s(NOTICE_AGAIN_S * self._clock.rate)
