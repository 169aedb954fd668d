"""A context switch carried out: RCs disconnect from one ARC and connect to the next.

Rules of this file:

* All or nothing: if one step of a connection fails, the switch undoes all of it before it reports the failure.
* If an RC without another holder refuses its disconnection, or does not confirm it in time, the switch does not wait
  for it. The caller counts it as down until it has confirmed. If an RC has other holders, the switch waits until its
  lease is over. The next holder of a unit RC may be late, but there are never two. After a death the successor confirms
  (decision 0006).
* An ARC that does not answer delays no other ARC: its epoch ends with the disconnection of its RCs.

Source: RAM 2002, "The RC Scheduler", last paragraph.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError, Refusal
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.failures import Failures, Note
from backbone.rc_manager.messages import (
    CloseGate,
    Connect,
    Connected,
    Disconnect,
    Disconnected,
    GateClosed,
    GateOpens,
    OpenGate,
)
from backbone.scheduling.events import ConnectArc, RevokeArc
from backbone.scheduling.requests import LEASE_S, RcUse

log = logging.getLogger(__name__)

RC_REPLY_S = 0.5  # chosen: a hundred round trips; an RC that needs longer counts as gone
ASK_AGAIN_S = 0.1  # chosen: a killed RC is back after two or three of these; a twentieth of a lease
ARC_REPLY_S = 1.0  # chosen: an ARC asks RCs before it opens
CONFIRM_S = 0.04  # chosen: ten round trips, within the tolerance of a trace; also for RCs that are late already
CLOSE_S = 0.2  # chosen: an ARC shuts its gate in milliseconds; a hung ARC must not cost the next one its turn

Hold = tuple[str, str, int]
"""RC, ARC and epoch."""


class Vain(NamedTuple):
    """A connection in vain, which is undone.

    Attributes:
        failed: The RC that failed; empty if the ARC did not open its gate.
        unconfirmed: RCs that did not confirm their disconnection: see ``revoke``.
    """

    failed: str
    unconfirmed: list[str]


class ContextSwitch:
    """Connects RCs, disconnects them and opens gates for the schedule manager.

    Args:
        note: Adds an event to the story of a subject.
        failures: Gets the failures of RCs and ARCs.
        may_leave: Returns whether a switch may skip an RC that an ARC loses: it is down, or has no other holder.
    """

    def __init__(
        self, bus: Bus, clock: Clock, note: Note, failures: Failures, may_leave: Callable[[str, str], bool]
    ) -> None:
        self._bus, self._clock, self._note, self._failures, self._may_leave = bus, clock, note, failures, may_leave
        self._given_back: set[str] = set()
        self._left: defaultdict[str, dict[Hold, float]] = defaultdict(dict)

    def gives_back(self, arc: str) -> bool:
        """Return whether a connection of this ARC failed and is being undone: its leases must not be renewed."""
        return arc in self._given_back

    async def connect(self, order: ConnectArc, within_s: float) -> Vain | None:
        """Connect all RCs to the ARC and order it to open its gate, or undo all of it.

        Args:
            order: Instruction of the schedule manager.
            within_s: Mission seconds after which undoing skips RCs without another holder.

        Returns:
            None: the gate is open. Else the ARC holds nothing.
        """
        settled_s = self._clock.now_s() + order.settle_s
        failed = await self._connect_rcs(order)
        if not failed and await self._open_gate(order, settled_s):
            return None
        close = CloseGate("failed", failed or order.arc, 0.0, -1.0)
        holds, why = _holds(order.arc, order.epochs), f"failed at {failed or order.arc}"
        self._given_back.add(order.arc)
        try:
            async with asyncio.TaskGroup() as both:
                both.create_task(self._close_gate(order.arc, close))
                undoing = both.create_task(self._disconnect(holds, why, self._clock.now_s() + within_s))
        finally:
            self._given_back.discard(order.arc)
        return Vain(failed or "", undoing.result())

    async def revoke(self, order: RevokeArc, within_s: float) -> list[str]:
        """Close the ARC's gate and disconnect its RCs; return when all RCs are free, except skipped ones.

        Args:
            order: Instruction of the schedule manager.
            within_s: Mission seconds after which RCs without another holder are skipped.

        Returns:
            RCs that did not confirm: the caller counts them as down, and calls ``clear`` before they count as up.
        """
        free_by_s = self._clock.now_s() + within_s
        close = CloseGate(order.why, order.by, order.deadline_s, order.expected_s)
        holds = _holds(order.arc, order.epochs)
        if order.deadline_s > 0:  # its decision process may stop cleanly while it still commands
            await self._close_gate(order.arc, close)
            return await self._disconnect(holds, order.why, free_by_s)
        async with asyncio.TaskGroup() as both:
            both.create_task(self._close_gate(order.arc, close))
            disconnecting = both.create_task(self._disconnect(holds, order.why, free_by_s))
        return disconnecting.result()

    async def clear(self, rc: str, found: Sequence[Hold]) -> bool:
        """End the remaining holds of an RC that was down: those that it reports, and those skipped while it was down.

        Returns:
            True if the RC confirmed the end of all holds.
        """
        left = self._left[rc]
        for over in [hold for hold, until_s in left.items() if until_s <= self._clock.now_s()]:
            del left[over]
        while holds := [*dict.fromkeys([*found, *(one for one in left if left[one] > self._clock.now_s())])]:
            if await self._disconnect(holds, "held from before it was down", math.inf):
                return False
            found = ()
            for hold in holds:
                left.pop(hold, None)
        return True

    async def end_orphans(self, holds: Sequence[Hold], arcs: Sequence[str]) -> list[str]:
        """Disconnect these holds of before a restart, and close the gates of these ARCs, all at once.

        Returns:
            RCs that did not confirm within ``RC_REPLY_S``: the caller calls ``clear`` before they count as up.
        """
        close = CloseGate("lease", component_of(RC_MANAGER), 0.0, -1.0)
        free_by_s = self._clock.now_s() + RC_REPLY_S * self._clock.rate
        async with asyncio.TaskGroup() as both:
            for arc in arcs:
                both.create_task(self._close_gate(arc, close))
            disconnecting = both.create_task(self._disconnect(holds, "not adopted after a restart", free_by_s))
        return disconnecting.result()

    async def _connect_rcs(self, order: ConnectArc) -> str | None:
        """Connect all RCs at once; return the name of one that failed, or None."""
        lease_s = LEASE_S * self._clock.rate
        epochs = dict(order.epochs)

        async def connect(rc: str, epoch: int) -> None:
            question = Connect(order.arc, epoch, lease_s, order.uses.get(rc, RcUse()), epochs, order.ranks.get(rc, 0))
            await self._bus.ask(in_pool(rc), question, Connected, within_s=RC_REPLY_S)

        outcomes = await asyncio.gather(*(connect(rc, epoch) for rc, epoch in epochs.items()), return_exceptions=True)
        for rc, outcome in zip(epochs, outcomes, strict=True):
            if isinstance(outcome, Refusal | LinkError):
                log.warning("%s could not be connected to %s: %s", rc, order.arc, outcome)
                self._failures.complain(rc, f"could not be connected to {order.arc}", outcome)
                return rc
            if outcome is not None:
                raise outcome
        return None

    async def _open_gate(self, order: ConnectArc, settled_s: float) -> bool:
        """Have the ARC open its gate; return whether it did."""
        question = OpenGate(dict(order.epochs), settled_s, order.until_s)
        try:
            await self._bus.ask(in_pool(order.arc), question, GateOpens, within_s=ARC_REPLY_S)
        except (Refusal, LinkError) as error:
            log.warning("%s did not open: %s", order.arc, error)
            self._failures.complain(order.arc, "did not open its gate", error)
            return False
        await self._clock.sleep_until_s(settled_s)  # the ARC opens by the same clock: it need not report that
        return True

    async def _close_gate(self, arc: str, question: CloseGate) -> None:
        within_s = question.deadline_s / self._clock.rate or CLOSE_S
        try:
            await self._bus.ask(in_pool(arc), question, GateClosed, within_s=within_s)
        except (Refusal, LinkError) as error:
            self._note(arc, f"did not close its gate: {error}")

    async def _disconnect(self, holds: Sequence[Hold], reason: str, free_by_s: float) -> list[str]:
        """Disconnect all at once; after ``free_by_s`` skip the RCs that may be skipped, for ``clear``.

        Returns:
            RCs that did not confirm: they were skipped, or their leases are over.
        """
        lease_until_s = self._clock.now_s() + LEASE_S * self._clock.rate
        confirmed = await asyncio.gather(*(self._end(hold, reason, lease_until_s, free_by_s) for hold in holds))
        return [rc for (rc, _, _), has_confirmed in zip(holds, confirmed, strict=True) if not has_confirmed]

    async def _end(self, hold: Hold, reason: str, lease_until_s: float, free_by_s: float) -> bool:
        """Disconnect one RC; return whether it confirmed."""
        rc, arc, epoch = hold
        has_complained = False
        while (left_s := self._real_s(lease_until_s)) > 0:
            may_leave = self._may_leave(rc, arc)  # else only an answer, or the lease, makes it free
            wait_s = max(CONFIRM_S, self._real_s(free_by_s)) if may_leave else RC_REPLY_S
            within_s = min(RC_REPLY_S, left_s, wait_s)
            try:
                await self._bus.ask(in_pool(rc), Disconnect(arc, epoch, reason), Disconnected, within_s=within_s)
                return True
            except (Refusal, LinkError) as error:
                if not has_complained:
                    self._failures.complain(rc, f"did not confirm its disconnection from {arc}", error)
                has_complained = True
                does_not_obey = isinstance(error, Refusal)  # its hardware stops by itself if at all
            is_late = free_by_s < math.inf and (does_not_obey or self._real_s(free_by_s) < ASK_AGAIN_S)
            if is_late and self._may_leave(rc, arc):
                self._left[rc][hold] = lease_until_s
                return False
            pause_s = left_s if does_not_obey else min(ASK_AGAIN_S, left_s)
            await self._clock.sleep_s(pause_s * self._clock.rate)
        return False

    def _real_s(self, until_s: float) -> float:
        """Return the seconds until then on the machine's clock."""
        return (until_s - self._clock.now_s()) / self._clock.rate


def _holds(arc: str, epochs: Mapping[str, int]) -> list[Hold]:
    return [(rc, arc, epoch) for rc, epoch in epochs.items()]


def in_pool(name: str) -> str:
    """Return the address of an RC or ARC."""
    return f"{Subsystem.RESOURCE_POOL}/{name}"
