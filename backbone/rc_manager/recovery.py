"""Recovery: collects the components, the holders from the RCs, and the requests from the ARCs.

Rule of this file: it asks and collects; it decides nothing.

Source: RAM 2002, "The RC Scheduler"; the RCs' answers are authoritative.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock, Reply
from backbone.component.messages import ComponentState
from backbone.dependency_database.messages import Resource
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.context_switch import RC_REPLY_S
from backbone.rc_manager.messages import AskRc, AskRequest, CurrentRequest, RcState
from backbone.scheduling.events import Adopted, RcKnown
from backbone.wire import Message

log = logging.getLogger(__name__)

SERVICE_REPLY_S = 1.0  # chosen: core services answer in milliseconds; without an answer by then, the question was lost
LARGEST_CAPACITY = 1.0  # a share of its time
RETRY_S = 0.1  # chosen: a restarted hub is back within a few of these


@dataclass(frozen=True, slots=True)
class Found:
    """Findings of a starting RC manager.

    Attributes:
        rcs: RCs that answered, by name.
        arcs: ARCs that answered, by name.
    """

    rcs: Mapping[str, RcState]
    arcs: Mapping[str, CurrentRequest]

    def holds_rightly(self, arc: str) -> bool:
        """Return whether every RC confirms the ARC's belief that it holds it."""
        current = self.arcs.get(arc)
        if current is None or not current.epochs:
            return False
        return all(
            rc in self.rcs and any(h.arc == arc and h.epoch == epoch for h in self.rcs[rc].holders)
            for rc, epoch in current.epochs.items()
        )

    def orphans(self) -> list[tuple[str, str, int]]:
        """Return RC, ARC and epoch of each hold without its ARC's belief, and of each belief without its hold.

        The RC of such a belief may be the successor of a killed one, and must confirm for it (decision 0006).
        """
        holds = [(rc.name, holder.arc, holder.epoch) for rc in self.rcs.values() for holder in rc.holders]
        beliefs = [
            (rc, arc, epoch)
            for arc, current in self.arcs.items()
            for rc, epoch in current.epochs.items()
            if rc in self.rcs and epoch <= self.rcs[rc].last_epoch
        ]
        return [hold for hold in dict.fromkeys([*holds, *beliefs]) if not self.holds_rightly(hold[1])]

    def strays(self) -> list[str]:
        """Return the ARCs whose gates may be open, or about to open, although their holds are not all confirmed."""
        held = [arc for _, arc, _ in self.orphans()]
        believing = [arc for arc, current in self.arcs.items() if current.epochs and not self.holds_rightly(arc)]
        return [*dict.fromkeys([*held, *believing])]

    def waiting(self) -> list[CurrentRequest]:
        """Return the requests of the ARCs without confirmed holds, in the order of their places in line."""
        requests = [current for arc, current in self.arcs.items() if not self.holds_rightly(arc)]
        return sorted(requests, key=lambda current: current.waits_since_s)

    def without(self, rcs: Collection[str]) -> Found:
        """Return the findings without these RCs."""
        return Found({rc: state for rc, state in self.rcs.items() if rc not in rcs}, self.arcs)

    def adopted(self, resources: Mapping[str, Resource], now_s: float) -> list[tuple[float, Adopted]]:
        """Return the time of connection of each ARC with confirmed holds, in the order of these times."""
        times = []
        for arc, current in self.arcs.items():
            if self.holds_rightly(arc):
                granted_s = current.granted_s if 0.0 <= current.granted_s <= now_s else now_s
                settle_s = max(resources[rc].connect_s for rc in current.epochs)
                times.append((granted_s, max(0.0, granted_s - settle_s), arc))
        found, newest = [], dict[str, int]()
        for granted_s, connected_s, arc in sorted(times):
            current = self.arcs[arc]
            overtaken = [rc for rc, epoch in current.epochs.items() if epoch < newest.get(rc, 0)]
            newest.update((rc, epoch) for rc, epoch in current.epochs.items() if rc not in overtaken)
            found.append((connected_s, Adopted(current.request, current.epochs, granted_s, overtaken)))
        return sorted(found, key=lambda one: one[0])


def has_its_rcs(current: CurrentRequest, known: Collection[str]) -> bool:
    """Return whether the RCs that were chosen for the request are all known, and one of its alternatives."""
    chosen = {*current.rcs}
    is_whole = bool(chosen) and chosen.issubset(known)
    return is_whole and any(wish.keys() == chosen for wish in current.request.alternatives)


def rc_known(resource: Resource, state: RcState | None) -> RcKnown:
    """Return the event that introduces an RC.

    With holders its capacity is the largest one, because they may have been connected before it was lowered. The caller
    reports the present capacity after these.

    Args:
        resource: Its declaration in the mission file.
        state: The RC's report; None: it is not up.
    """
    return RcKnown(
        rc=resource.name,
        kind=resource.type,
        sharable=resource.sharable,
        capacity=LARGEST_CAPACITY if state is not None and state.holders else resource.capacity,
        connect_s=resource.connect_s,
        disconnect_s=resource.disconnect_s,
        up=state is not None,
        last_epoch=0 if state is None else state.last_epoch,
        is_robot=resource.is_robot,
    )


class Recovery:
    """Asks nameserver, RCs and ARCs."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock

    async def find(self, rcs: Collection[str]) -> Found:
        """Ask every RC for its holders and every ARC for its request.

        Args:
            rcs: Names of all declared RCs.
        """
        pool = [c.address for c in await self._listing() if c.address.startswith(f"{Subsystem.RESOURCE_POOL}/")]
        held = await self.ask_all([at for at in pool if component_of(at) in rcs], AskRc(), RcState)
        asked = await self.ask_all([at for at in pool if component_of(at) not in rcs], AskRequest(), CurrentRequest)
        return Found(held, asked)

    async def present(self) -> set[str]:
        """Return the names of all components, once the nameserver's list is complete."""
        return {component_of(component.address) for component in await self._listing()}

    async def is_present(self, name: str) -> bool:
        """Return whether the nameserver knows a component of this name, once its list is complete."""
        while True:
            try:
                await self.until_answered(NAMESERVER, Resolve(name), Resolved)
            except UnknownName as unknown:
                if unknown.facts.get("complete", True):
                    return False
            else:
                return True
            await self._clock.sleep_s(RETRY_S * self._clock.rate)

    async def ask_all(self, addresses: Sequence[str], question: Message, reply: type[Reply]) -> dict[str, Reply]:
        """Ask all addresses at once; return the answers, by name."""

        async def one(of: str) -> Reply | None:
            try:
                return await self._bus.ask(of, question, reply, within_s=RC_REPLY_S)
            except (Refusal, LinkError):
                return None  # a component of another kind, or one that is ending

        answers = await asyncio.gather(*(one(of) for of in addresses))
        return {component_of(of): got for of, got in zip(addresses, answers, strict=True) if got is not None}

    async def until_answered(self, of: str, question: Message, reply: type[Reply]) -> Reply:
        """Ask a core service repeatedly until it answers."""
        while True:
            try:
                return await self._bus.ask(of, question, reply, within_s=SERVICE_REPLY_S)
            except LinkError as error:
                log.info("%s does not answer yet: %s", of, error)
                await self._clock.sleep_s(RETRY_S * self._clock.rate)

    async def _listing(self) -> list[ComponentState]:
        while True:
            found = await self.until_answered(NAMESERVER, ListComponents(), Components)
            if found.complete:
                return found.components
            await self._clock.sleep_s(RETRY_S * self._clock.rate)
