"""Resource controller: the one process through which a physical resource is reached.

It serves whoever the RC manager connected it to, under an epoch, for as long as the lease lasts.
Everything else is refused, counted, and changes nothing. At the end of a hold, however it comes, the
resource goes to its safe state before anything else can happen to it.

Source: RAM 2002, "Resource Pool"; IROS 2001, section 3.2.
"""

from __future__ import annotations

import asyncio
import logging
import types
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import (
    AskRc,
    Connect,
    Connected,
    Disconnect,
    Disconnected,
    Holder,
    Leases,
    RcState,
    StaleEpoch,
)
from backbone.wire import Envelope, Message
from resource_pool.drivers.interface import DriverSite
from resource_pool.holds import Hold, HoldTable

log = logging.getLogger(__name__)

EPOCHS_PER_S = 1000  # chosen: an RC that restarts begins above all it ever had, as no RC changes hands so often


class RcParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What every RC is told of its resource; derive and add the kind's own.

    Attributes:
        driver: Name of the driver, or ``package.module:Class``.
        sharable: True if several ARCs may hold it.
        capacity: Share of its time it can give, 0 to 1.
        links: Other resources it works with: kind → names.
        world: Simulated world that plays the hardware, for the simulated drivers.
    """

    driver: str = "simulated"
    sharable: bool = False
    capacity: float = 1.0
    links: dict[str, list[str]] = {}
    world: str = "world"


R = TypeVar("R", bound=RcParameters)


class ResourceController(Component[R], Generic[R]):
    """Base of every RC; derive, set ``parameters_type`` and ``commands``, override the hooks."""

    parameters_type: ClassVar[type[msgspec.Struct]] = RcParameters
    commands: ClassVar[types.UnionType | type[Any] | None] = None
    """Questions this kind of RC answers besides those of the RC manager."""
    accepts: ClassVar[types.UnionType | type[Any] | None] = Connect | Disconnect | AskRc

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.commands is not None:
            cls.accepts = Connect | Disconnect | AskRc | cls.commands

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        first_epoch = int(clock.now_s() * EPOCHS_PER_S)
        self.holds = HoldTable(self.name, sharable=self.parameters.sharable, last_epoch=first_epoch)
        self.applied = self.refused_stale = 0
        self._connects = self._lease_ends = 0
        self._changing = asyncio.Lock()
        self._lease_changed = asyncio.Event()

    # ------------------------------------------------------------------ hooks
    async def connected(self, hold: Hold) -> None:
        """Get ready to serve this hold. When: it is in the table, nobody commands yet. Not: wait for the ARC."""

    async def make_safe(self, hold: Hold) -> None:
        """Bring what this hold could command into its safe state.

        When: the hold is no longer in the table, so no command of it can come any more; before the
        disconnection is confirmed. What: stop, switch off, drop what is queued.
        """

    async def command(self, asked: Envelope[Any]) -> Message:
        """Carry out one of ``commands``. Call ``admit`` first: it refuses what is not of the present hold."""
        return await super().answer(asked)

    # ------------------------------------------------------------------ for derived classes
    def driver_site(self) -> DriverSite:
        """Return what a driver of this RC may use."""
        return DriverSite(self.name, self.bus, self.clock, self.parameters, lambda what: self.tell(self.name, what))

    def admit(self, arc: str, epoch: int) -> Hold:
        """Return the hold under which the command may be carried out, and count it.

        Raises:
            StaleEpoch: It is not of the present hold; that is counted too, and nothing is applied.
        """
        try:
            hold = self.holds.admit(arc, epoch)
        except StaleEpoch:
            self.refused_stale += 1
            self.story.note(arc, f"a command of its epoch {epoch} was refused")
            raise
        self.applied += 1
        return hold

    def rc_state(self) -> RcState:
        """Return who holds the resource and what was counted."""
        holders = [Holder(hold.arc, hold.epoch, hold.since_s, hold.lease_until_s) for hold in self.holds.holds()]
        return RcState(
            self.name,
            self.launch.type,
            self.parameters.sharable,
            self.parameters.capacity,
            holders,
            self.holds.last_epoch,
            self.applied,
            self.refused_stale,
            self.feedback,
        )

    # ------------------------------------------------------------------ the life of a hold
    async def connect(self) -> None:
        """Listen to the RC manager's renewals."""
        self.bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard_leases)

    async def serve(self) -> None:
        """End every hold whose lease is over."""
        while True:
            self._lease_changed.clear()
            expiry_s = self.holds.next_expiry_s()
            if expiry_s is None:
                await self._lease_changed.wait()
                continue
            await self.clock.sleep_until_s(expiry_s)
            async with self._changing:
                for hold in self.holds.expire(self.clock.now_s()):
                    self._lease_ends += 1
                    log.warning("the lease of %s is over", hold.arc)
                    await self._end_hold(hold, "its lease is over")

    async def drain(self) -> None:
        """End all holds, safely."""
        async with self._changing:
            for hold in self.holds.holds():
                self.holds.disconnect(hold.arc, hold.epoch)
                await self._end_hold(hold, "the RC ends")

    async def answer(self, asked: Envelope[Any]) -> Message:
        """Connect, disconnect, tell who holds, or carry out a command."""
        match asked.body:
            case Connect() as order:
                return await self._connect(order)
            case Disconnect(arc=arc, epoch=epoch, reason=reason):
                async with self._changing:
                    hold = self.holds.disconnect(arc, epoch)
                    if hold is not None:
                        await self._end_hold(hold, reason)
                return Disconnected(self.holds.last_epoch)
            case AskRc():
                return self.rc_state()
            case _:
                return await self.command(asked)

    def statistics(self) -> dict[str, float]:
        """Count commands, connections, and ends by lease."""
        return {
            "applied": self.applied,
            "refused_stale": self.refused_stale,
            "connects": self._connects,
            "lease_ends": self._lease_ends,
        }

    async def _connect(self, order: Connect) -> Connected:
        async with self._changing:
            now_s = self.clock.now_s()
            hold = Hold(order.arc, order.epoch, now_s, now_s + order.lease_s, order.use, order.companions, order.rank)
            self.holds.connect(hold)
            self._connects += 1
            self._lease_changed.set()
            await self.connected(hold)
            self.story.note(order.arc, f"connected under epoch {order.epoch}")
            self._publish_holders()
        return Connected(order.epoch)

    async def _end_hold(self, hold: Hold, reason: str) -> None:
        await self.make_safe(hold)
        self.story.note(hold.arc, f"disconnected: {reason}")
        self._publish_holders()

    def _publish_holders(self) -> None:
        holders = ", ".join(hold.arc for hold in self.holds.holds())
        self.report(f"held by {holders}" if holders else "free")
        self.bus.publish(self.address, Conversation.TELEMETRY, self.rc_state())

    def _heard_leases(self, envelope: Envelope[Any]) -> None:
        leases: Leases = envelope.body
        for lease in leases.leases:
            if lease.rc == self.name:
                self.holds.renew(lease.arc, lease.epoch, envelope.stamp_s + leases.lease_s)
