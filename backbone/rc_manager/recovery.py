"""Roll call: who is there, what each RC says who holds it, and what each ARC asks for.

Rule of this file: it asks and listens; what follows from the answers, others decide.

Source: RAM 2002, "The RC Scheduler"; truth lives with those who hold the hardware.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from backbone.bus.interface import Bus, Clock, Reply
from backbone.component.messages import ComponentState
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import ADDRESS as NAMESERVER
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.context_switch import RC_REPLY_S
from backbone.rc_manager.messages import AskRc, AskRequest, CurrentRequest, RcState
from backbone.wire import Message

log = logging.getLogger(__name__)

SERVICE_REPLY_S = 1.0  # chosen: core services answer in milliseconds; after this the question was lost
RETRY_S = 0.1  # chosen: a restarted hub is back within a few of these


@dataclass(frozen=True, slots=True)
class Found:
    """What a starting RC manager finds.

    Attributes:
        rcs: RCs that answered, by name.
        arcs: ARCs that answered, by name.
    """

    rcs: Mapping[str, RcState]
    arcs: Mapping[str, CurrentRequest]

    def holds_rightly(self, arc: str) -> bool:
        """Say whether every RC the ARC thinks it holds says so too."""
        current = self.arcs.get(arc)
        if current is None or not current.epochs:
            return False
        return all(
            rc in self.rcs and any(h.arc == arc and h.epoch == epoch for h in self.rcs[rc].holders)
            for rc, epoch in current.epochs.items()
        )

    def orphans(self) -> list[tuple[str, str, int]]:
        """Return RC, ARC and epoch of each hold that is not right."""
        return [
            (rc.name, holder.arc, holder.epoch)
            for rc in self.rcs.values()
            for holder in rc.holders
            if not self.holds_rightly(holder.arc)
        ]


class Recovery:
    """Asks nameserver, RCs and ARCs.

    Args:
        bus: Of the RC manager.
        clock: The mission's time.
    """

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock

    async def find(self, rcs: Collection[str]) -> Found:
        """Ask every RC who holds it and every ARC what it asks for.

        Args:
            rcs: Names of all RCs there can be.
        """
        pool = [c.address for c in await self._listing() if c.address.startswith(f"{Subsystem.RESOURCE_POOL}/")]
        held = await self.ask_all([at for at in pool if component_of(at) in rcs], AskRc(), RcState)
        asked = await self.ask_all([at for at in pool if component_of(at) not in rcs], AskRequest(), CurrentRequest)
        return Found(held, asked)

    async def present(self) -> set[str]:
        """Return the names of all components, once the nameserver can tell for sure."""
        return {component_of(component.address) for component in await self._listing()}

    async def ask_all(self, addresses: Sequence[str], question: Message, reply: type[Reply]) -> dict[str, Reply]:
        """Ask all at once; return the answers of those that gave one, by name."""

        async def one(of: str) -> Reply | None:
            try:
                return await self._bus.ask(of, question, reply, within_s=RC_REPLY_S)
            except (Refusal, LinkError):
                return None  # a component of another kind, or one that is just dying

        answers = await asyncio.gather(*(one(of) for of in addresses))
        return {component_of(of): got for of, got in zip(addresses, answers, strict=True) if got is not None}

    async def until_answered(self, of: str, question: Message, reply: type[Reply]) -> Reply:
        """Ask a core service again and again until it answers."""
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
