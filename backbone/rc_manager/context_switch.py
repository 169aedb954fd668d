"""A context switch carried out: RCs disconnect from one ARC and connect to the next.

Rules of this file:

* All or nothing: if one step of a connection fails, all of it is undone before anybody is told.
* An RC that does not confirm its disconnection is asked again and counts as held until it confirms or its lease is
  over: a holder may be late, there are never two. After a death its successor confirms (decision 0006), and does so
  before it is counted as up, so that the ARC's other RCs need not wait for it.
* An ARC that does not answer delays nobody: its epoch ends with the disconnection of its RCs.

Source: RAM 2002, "The RC Scheduler", last paragraph.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError, Refusal
from backbone.naming import Subsystem
from backbone.rc_manager.decisions import ConnectArc, RevokeArc
from backbone.rc_manager.messages import (
    LEASE_S,
    CloseGate,
    Connect,
    Connected,
    Disconnect,
    Disconnected,
    GateClosed,
    GateOpens,
    OpenGate,
    RcUse,
)

log = logging.getLogger(__name__)

RC_REPLY_S = 0.5  # chosen: a hundred round trips; an RC that needs longer is not there
ASK_AGAIN_S = 0.1  # chosen: a killed RC is back after two or three of these; a twentieth of a lease
ARC_REPLY_S = 1.0  # chosen: an ARC asks RCs before it opens
CLOSE_S = 0.2  # chosen: an ARC shuts its gate in milliseconds; one that hangs must not cost the next its turn

Note = Callable[[str, str], Any]
Hold = tuple[str, str, int]
"""RC, ARC and epoch."""


class ContextSwitch:
    """Speaks to RCs and ARCs on behalf of the schedule manager.

    Args:
        bus: Of the RC manager.
        clock: The mission's time.
        note: Keeps that something happened to a subject.
        is_down: Says whether an RC is known to be down.
    """

    def __init__(self, bus: Bus, clock: Clock, note: Note, is_down: Callable[[str], bool]) -> None:
        self._bus, self._clock, self._note, self._is_down = bus, clock, note, is_down
        self._given_back: set[str] = set()
        self._left: dict[str, dict[Hold, float]] = {}

    def gives_back(self, arc: str) -> bool:
        """Say whether a connection of this ARC failed and is being undone: its leases must not be renewed."""
        return arc in self._given_back

    async def connect(self, order: ConnectArc, uses: Mapping[str, RcUse]) -> str | None:
        """Connect all RCs to the ARC and have it open its gate, or undo all of it.

        Args:
            order: What the schedule manager decided.
            uses: How the ARC uses each RC; exclusively if not said.

        Returns:
            None: the gate is open. Else the RC that failed, empty if it was the ARC; nothing is held.
        """
        settled_s = self._clock.now_s() + order.settle_s
        failed = await self._connect_rcs(order, uses)
        if failed is None and await self._open_gate(order, settled_s):
            return None
        close = CloseGate("failed", failed or order.arc, 0.0, -1.0)
        self._given_back.add(order.arc)
        try:
            async with asyncio.TaskGroup() as both:
                both.create_task(self._close_gate(order.arc, close))
                both.create_task(self._disconnect(_holds(order.arc, order.epochs), f"failed at {failed or order.arc}"))
        finally:
            self._given_back.discard(order.arc)
        return failed or ""

    async def revoke(self, order: RevokeArc) -> list[str]:
        """Close the ARC's gate and disconnect its RCs; return when nothing that is up is held any more.

        Returns:
            RCs that never confirmed: they counted as held until their leases were over.
        """
        close = CloseGate(order.why, order.by, order.deadline_s, order.expected_s)
        holds = _holds(order.arc, order.epochs)
        if order.deadline_s > 0:  # its decision process may stop cleanly while it still commands
            await self._close_gate(order.arc, close)
            return await self._disconnect(holds, order.why)
        async with asyncio.TaskGroup() as both:
            both.create_task(self._close_gate(order.arc, close))
            disconnecting = both.create_task(self._disconnect(holds, order.why))
        return disconnecting.result()

    async def clear(self, rc: str, found: Sequence[Hold]) -> None:
        """End what an RC that was down still holds: by its own word, and what was left to it while it was down."""
        while holds := {*found, *(h for h, until_s in self._left.pop(rc, {}).items() if until_s > self._clock.now_s())}:
            await self.disconnect([*holds], "held from before it was down")
            found = ()

    async def disconnect(self, holds: Sequence[Hold], reason: str) -> None:
        """Disconnect all at once; wait for each until it confirms or its lease is over."""
        await self._disconnect(holds, reason, also_down=True)

    async def _connect_rcs(self, order: ConnectArc, uses: Mapping[str, RcUse]) -> str | None:
        """Connect all RCs at once; return the name of one that failed, or None."""
        lease_s = LEASE_S * self._clock.rate
        epochs = dict(order.epochs)

        async def connect(rc: str, epoch: int) -> None:
            question = Connect(order.arc, epoch, lease_s, uses.get(rc, RcUse()), epochs, order.ranks.get(rc, 0))
            await self._bus.ask(_in_pool(rc), question, Connected, within_s=RC_REPLY_S)

        outcomes = await asyncio.gather(*(connect(rc, epoch) for rc, epoch in epochs.items()), return_exceptions=True)
        for rc, outcome in zip(epochs, outcomes, strict=True):
            if isinstance(outcome, Refusal | LinkError):
                log.warning("%s could not be connected to %s: %s", rc, order.arc, outcome)
                self._note(rc, f"could not be connected to {order.arc}: {outcome}")
                return rc
            if outcome is not None:
                raise outcome
        return None

    async def _open_gate(self, order: ConnectArc, settled_s: float) -> bool:
        question = OpenGate(dict(order.epochs), settled_s, order.until_s)
        try:
            await self._bus.ask(_in_pool(order.arc), question, GateOpens, within_s=ARC_REPLY_S)
        except (Refusal, LinkError) as error:
            log.warning("%s did not open: %s", order.arc, error)
            self._note(order.arc, f"did not open its gate: {error}")
            return False
        await self._clock.sleep_until_s(settled_s)  # the ARC opens by the same clock: no word of it is needed
        return True

    async def _close_gate(self, arc: str, question: CloseGate) -> None:
        within_s = CLOSE_S + question.deadline_s / self._clock.rate
        try:
            await self._bus.ask(_in_pool(arc), question, GateClosed, within_s=within_s)
        except (Refusal, LinkError) as error:
            self._note(arc, f"did not close its gate: {error}")

    async def _disconnect(self, holds: Sequence[Hold], reason: str, *, also_down: bool = False) -> list[str]:
        """Disconnect all at once; leave those that are down to ``clear`` unless told to wait for them, too.

        Returns:
            RCs that had not confirmed when their leases were over.
        """
        lease_until_s = self._clock.now_s() + LEASE_S * self._clock.rate
        ended = await asyncio.gather(*(self._end(hold, reason, lease_until_s, also_down) for hold in holds))
        return [rc for (rc, _, _), has_ended in zip(holds, ended, strict=True) if not has_ended]

    async def _end(self, hold: Hold, reason: str, lease_until_s: float, also_down: bool) -> bool:
        """Return whether the RC confirmed, or is down and was left."""
        rc, arc, epoch = hold
        complain = self._note
        while (left_s := (lease_until_s - self._clock.now_s()) / self._clock.rate) > 0:
            try:
                within_s = min(RC_REPLY_S, left_s)
                await self._bus.ask(_in_pool(rc), Disconnect(arc, epoch, reason), Disconnected, within_s=within_s)
                return True
            except (Refusal, LinkError) as error:
                complain(rc, f"did not confirm its disconnection from {arc}: {error}")
                complain = _keep_quiet
                if isinstance(error, Refusal):  # its hardware does not obey, and comes to rest by itself if at all
                    await self._clock.sleep_until_s(lease_until_s)
                    return False
            if self._is_down(rc) and not also_down:
                self._left.setdefault(rc, {})[hold] = lease_until_s
                return True
            await self._clock.sleep_s(min(ASK_AGAIN_S, left_s) * self._clock.rate)
        return False


def _keep_quiet(_subject: str, _what: str) -> None:
    """Note nothing: it was noted already."""


def _holds(arc: str, epochs: Mapping[str, int]) -> list[Hold]:
    return [(rc, arc, epoch) for rc, epoch in epochs.items()]


def _in_pool(name: str) -> str:
    return f"{Subsystem.RESOURCE_POOL}/{name}"
