"""Resource controller (RC): the one component that controls a physical resource.

It serves the ARCs that the RC manager connected, each under an epoch and while its lease lasts. It rejects and counts
all other commands. At every end of a hold the resource goes to its safe state before the next connection.

Source: RAM 2002, "Resource Pool"; IROS 2001, section 3.2.
"""

from __future__ import annotations

import asyncio
import dataclasses
import logging
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.abilities import Abilities, CameraForm, field_forms
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.exchange import SwapClass
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.ranges import LONGEST_LEASE_S
from backbone.rc_manager.messages import (
    EPOCHS_PER_S,
    AskRc,
    Connect,
    Connected,
    Disconnect,
    Disconnected,
    Leases,
    RcState,
    StaleEpoch,
    most_epoch,
)
from backbone.scheduling.requests import Holder
from backbone.waiting import only_bugs
from backbone.wire import Accepts, Envelope, Message, UnknownMessage
from resource_pool.commands import Command
from resource_pool.driver_adjusting import adjust_changed
from resource_pool.driver_exchange import DriverExchanges
from resource_pool.driver_slot import Again, DriverSlot, Judge, always, as_returned
from resource_pool.drivers.interface import DriverSite, HardwareFault, build_driver, options_of_drivers
from resource_pool.hold_ends import FAULTS, SAFE_WITHIN_S, HoldEnds, detail_of
from resource_pool.holds import Hold, HoldTable
from resource_pool.messages import Applied, ImpossibleUse, NotFromYou
from resource_pool.obeyed_commands import command_forms
from resource_pool.rc_parameters import RcParameters, sort_out_options
from resource_pool.returned_numbers import applied_values

__all__ = ["RcParameters", "ResourceController"]

log = logging.getLogger(__name__)


R = TypeVar("R", bound=RcParameters)


class ResourceController(Component[R], Generic[R]):
    """Base class of every RC; derive, set ``parameters_type`` and ``commands``, override ``obey`` and ``make_safe``."""

    parameters_type: ClassVar[type[msgspec.Struct]] = RcParameters
    given_elsewhere: ClassVar[frozenset[str]] = frozenset({"driver", "sharable", "capacity", "links", "options"})
    commands: ClassVar[Accepts | None] = None
    """Commands of this kind of RC: classes derived from ``Command``, or other messages for ``command``."""
    obeyed: ClassVar[tuple[type[Command], ...]] = ()
    """In a class to derive from that has ``obey``: the commands that this ``obey`` carries out."""
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """Field of its commands → smallest and largest value that the hardware obeys, if narrower than the field's."""
    reports: ClassVar[type[msgspec.Struct] | None] = None
    """Struct of its reports; None: it reports only its state."""
    body_class: ClassVar[str] = ""
    """Class path of a robot's body in simulated worlds, see ``scout_model.robot``; empty: mission files name one."""
    camera: ClassVar[CameraForm | None] = None
    """Model of a robot's camera, with which consoles convert points in a picture to places; None: not possible."""
    driver_kind: ClassVar[str] = ""
    """Kind of its driver; empty: it has no driver."""
    driver_protocol: ClassVar[type] = object
    """Protocol whose methods its driver must have."""
    driver_parameters: ClassVar[frozenset[str]] = frozenset({"options"})
    """Parameters that its driver may change while it runs."""
    outlasts_s: ClassVar[float] = 0.0
    """Time for which the effect of a command may outlast the process, mission seconds. For this time a restarted RC
    confirms no disconnection of an earlier hold. 0: the effect ends with the process."""
    driver_field: ClassVar[str] = "driver"
    """Name of the parameter that names the driver."""
    closed_most_s: ClassVar[float] = SAFE_WITHIN_S / 2
    """Longest time for which an exchange of the driver may close the device, while calls wait; machine seconds."""
    accepts: ClassVar[Accepts | None] = Connect | Disconnect | AskRc | SwapClass

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if cls.commands is not None and "commands" in vars(cls) and "accepts" not in vars(cls):
            cls.accepts = Connect | Disconnect | AskRc | SwapClass | cls.commands

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(sort_out_options(launch, self.parameters_type) if self.driver_kind else launch, bus, clock)
        self._born_s = clock.now_s()
        self._first_epoch = int(self._born_s * EPOCHS_PER_S)
        self.holds = HoldTable(self.name, sharable=self.parameters.sharable, last_epoch=self._first_epoch)
        self.applied = self.refused_stale = self.refused_strangers = 0
        self._connects = self._lease_ends = 0
        self._ends = HoldEnds(self)
        self._in_force = self.parameters
        self._slots: list[DriverSlot] = []
        self._exchanges = DriverExchanges(self)
        self._lease_changed = asyncio.Event()

    @classmethod
    def abilities(cls) -> Abilities:
        """Return the RC's commands and reports; see ``Component``."""
        return Abilities(
            is_robot=cls.is_robot,
            body_class=cls.body_class,
            commands=command_forms(cls, cls.commands, cls.limits),
            reports=field_forms(cls.reports) if cls.reports is not None else [],
            camera=cls.camera,
        )

    @classmethod
    def driver_options(cls, named: str = "") -> dict[str, type[msgspec.Struct]] | None:
        """Return the options of each built-in driver of this RC's kind, and of a named driver."""
        return options_of_drivers(cls.driver_kind, named, cls.driver_protocol) if cls.driver_kind else None

    async def connected(self, hold: Hold) -> None:
        """Prepare to serve this hold.

        When: after it is in the table, before any command. What: switch on, start streams. If it fails, or exceeds
        ``SAFE_WITHIN_S`` and is cancelled, ``make_safe`` is called and the ARC is refused. Not: wait for the ARC.
        """

    async def make_safe(self, hold: Hold) -> None:
        """Bring the resource of this hold into its safe state.

        When: after the hold has left the table, so no command of it can follow; before the disconnection is confirmed.
        What: stop, switch off, drop the queue. Raise ``HardwareFault`` if the hardware does not obey. After a fault, or
        if the hook exceeded ``SAFE_WITHIN_S`` and was cancelled, it is called again for the same hold before the next
        connection.
        """

    def permit(self, order: Command) -> None:
        """Check that the resource may obey this command now. When: after admission. What: raise a refusal if not."""

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Carry out a command.

        When: for each command of a present hold; cancelled when the hold ends. What: return the applied values, clipped
        to the hardware's limits, with units in their names. Raise ``HardwareFault`` if the hardware does not obey.
        """
        told = f"{self.name} declares {order.word()} and does not obey it"
        raise UnknownMessage(told, remedy=f"Obey it in {type(self).__name__}.obey, or remove it.", arc=hold.arc)

    async def command(self, asked: Envelope[Message]) -> Message:
        """Admit one of ``commands`` and carry it out. Override for messages with another answer than ``Applied``."""
        order = asked.body
        if not isinstance(order, Command):
            return await super().answer(asked)
        hold = self.admit(order.arc, order.epoch)
        self.permit(order)
        given = await self._ends.carry_out(hold, self.obey(hold, order))
        values = applied_values(given, order.word(), self.obey)
        return Applied(self.name, hold.epoch, self.clock.now_s(), order.word(), values)

    async def driver_exchanged(self) -> None:
        """Bring the driver to the state of this RC.

        When: after a new driver has taken over, or the old one is back. What: restore the driver's state, such as
        tuning, subscriptions or brightness; by default nothing. Not: state that the next command sets anyway.
        """

    async def driver_proved(self, since_s: float) -> None:
        """Wait until the driver that took over at this time has done what it is for, if anything was asked of it.

        When: at the end of its trial. What: raise ``HardwareFault`` if it does not within a time limit; by default
        nothing, because a call of a driver on trial that fails is seen anyway. Override if a driver acts by itself.
        """

    def ranked(self, arc: str, epoch: int) -> None:
        """Apply the rank of this hold, if the hold still exists. When: with each renewal."""

    def may_command(self, source: str, hold: Hold, order: Message) -> bool:  # noqa: ARG002
        """Return whether the source may send a command under this hold; True for the ARC that holds the RC."""
        return source == address(Subsystem.RESOURCE_POOL, hold.arc)

    def driver_site(self) -> DriverSite:
        """Return the interface for a driver of this RC."""
        return DriverSite(
            self.name,
            self.bus,
            self.clock,
            self.parameters,
            lambda what: self.publish_event(self.name, what),
            self.fail,
            Path(self.launch.run_directory) if self.launch.run_directory else None,
            self._ends.remark,
        )

    def make_driver(self, name: str = "", judge: Judge = as_returned, again: Again = always) -> Any:
        """Return a driver for this RC, not open yet: the named driver, or by default the one in the mission file.

        ``judge`` reads what the driver's methods return; ``again`` may refuse to repeat a call with the old driver.

        Raises:
            UnknownDriver: No driver has this name.
            WrongParameter: The driver refuses its options.
        """
        named = name or self.parameters.driver
        build = partial(build_driver, self.driver_kind, named, protocol=self.driver_protocol)
        slot = DriverSlot(self._exchanges.made(build, self.driver_site()), judge, again, self.fail)
        self._slots.append(slot)
        return slot.proxy

    def admit(self, arc: str, epoch: int) -> Hold:
        """Return the hold that admits the command, and count the command.

        Raises:
            StaleEpoch: The command is not of a present hold; it is counted as refused.
        """
        try:
            hold = self.holds.admit(arc, epoch, self.clock.now_s())
        except StaleEpoch:
            self.refused_stale += 1
            self.story.note(arc, f"a command of its epoch {epoch} was refused")
            raise
        self.applied += 1
        return hold

    def rc_state(self) -> RcState:
        """Return the holders and the counts."""
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

    async def connect(self) -> None:
        """Subscribe to the RC manager's renewals."""
        self.bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard_leases)

    async def serve(self) -> None:
        """End every hold whose lease has expired."""
        while True:
            self._lease_changed.clear()
            expiry_s = self.holds.next_expiry_s()
            if expiry_s is None:
                await self._lease_changed.wait()
                continue
            await self.clock.sleep_until_s(expiry_s)
            async with self._ends.changing:
                over = self.holds.expire(self.clock.now_s())
                self._lease_ends += len(over)
                for hold in over:
                    log.warning("the lease of %s has expired", hold.arc)
                await self._ends.end_all(over, "its lease is over")

    async def drain(self) -> None:
        """End all holds; bring the resource into its safe state if the hardware obeys."""
        async with self._ends.changing:
            ended = [self.holds.disconnect(hold.arc, hold.epoch) for hold in self.holds.holds()]
            still = [*self._ends.left(), *(hold for hold in ended if hold is not None)]
            await self._ends.end_all(still, "the RC ends")

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the RC manager and carry out commands."""
        match asked.body:
            case Connect() | Disconnect() if asked.source != RC_MANAGER:
                raise self._stranger(asked.source, f"{type(asked.body).__name__} {asked.body.arc}")
            case Connect(epoch=epoch) | Disconnect(epoch=epoch) if epoch > most_epoch(self.clock.now_s()):
                raise ImpossibleUse(f"{self.name}: the RC manager cannot have reached epoch {epoch} yet")
            case Connect() as order:
                return await self._connect(order, asked.stamp_s)
            case Disconnect(arc=arc, epoch=epoch, reason=reason):
                async with self._ends.changing:
                    hold = self.holds.disconnect(arc, epoch) or self._ends.unsafe(arc)
                    if hold is not None:
                        await self._ends.end(hold, reason)
                if epoch <= self._first_epoch:  # a grant to an earlier process, whose hardware may not be safe yet
                    await self.clock.sleep_until_s(self._born_s + self.outlasts_s)
                return Disconnected(self.holds.last_epoch)
            case AskRc():
                return self.rc_state()
            case SwapClass() as swap:
                return await self._exchanges.swap(swap, self._slots)
            case _:
                for slot in self._slots:
                    await slot.wait_open()
                self._check_sender(asked)
                return await self.command(asked)

    def parameters_changed(self) -> None:
        """Apply the new capacity and driver parameters; the RC manager gets the change with the published state.

        Raises:
            NeedsRestart: The running RC cannot change this parameter.
            WrongParameter: The driver refuses its options, or fails while it applies them.
        """
        site = self.driver_site()
        former = dataclasses.replace(site, parameters=self._in_force)
        adjust_changed([slot.proxy for slot in self._slots], site, former, self.driver_parameters)
        self._in_force = self.parameters
        self.changed()

    def has_driver(self, parameters: msgspec.Struct) -> None:
        """Apply the parameters, together with a new driver that already works."""
        self.parameters = self._in_force = self.with_parameters(msgspec.to_builtins(parameters))

    def publish_news(self) -> None:
        """Also publish the holders."""
        super().publish_news()
        self.bus.publish(self.address, Conversation.TELEMETRY, self.rc_state())

    def statistics(self) -> dict[str, float]:
        """Count commands, connections, expired leases, and safe states not reached at the first attempt."""
        return {
            "applied": self.applied,
            "refused_stale": self.refused_stale,
            "refused_strangers": self.refused_strangers,
            "connects": self._connects,
            "lease_ends": self._lease_ends,
            "safety_faults": self._ends.faults,
        }

    def _check_sender(self, asked: Envelope[Message]) -> None:
        """Refuse a command that names no ARC, or is of a present hold and from a component that may not command it.

        Raises:
            NotFromYou: The source is no ARC, or may not command under this hold.
        """
        order: Any = asked.body  # each of ``commands`` has the fields ``arc`` and ``epoch``
        hold = self.holds.find(order.arc, order.epoch)
        if not order.arc or (hold is not None and not self.may_command(asked.source, hold, order)):
            raise self._stranger(asked.source, f"{type(order).__name__} for {order.arc or 'no ARC'}")

    def _stranger(self, source: str, what: str) -> NotFromYou:
        """Count and log an order from a wrong sender; return the refusal."""
        self.refused_strangers += 1
        self.story.note(self.name, f"{source} was refused: {what}")
        return NotFromYou(f"{self.name} does not take {what} from {source}", source=source)

    async def _connect(self, order: Connect, given_s: float) -> Connected:
        if not 0 < order.lease_s <= LONGEST_LEASE_S:
            raise ImpossibleUse(f"{self.name}: a lease of {order.lease_s} s for {order.arc}")
        async with self._ends.changing:
            # Count from the order's own time stamp: the RC manager relies on that end, even if the order arrived late.
            since_s = self.clock.now_s()
            lease_until_s = min(given_s, since_s) + order.lease_s
            hold = Hold(order.arc, order.epoch, since_s, lease_until_s, order.use, order.companions, order.rank)
            former = self.holds.check(hold)
            if former is not None:
                self.holds.disconnect(former.arc, former.epoch)
                await self._ends.end(former, f"connected anew under epoch {order.epoch}")
            await self._ends.make_up()
            self.holds.connect(hold)
            try:
                async with asyncio.timeout(SAFE_WITHIN_S):  # other holds, and the RC's end, wait for this one
                    await only_bugs(self.connected(hold), f"connected of {self.name}")
            except FAULTS as error:
                self.holds.disconnect(hold.arc, hold.epoch)
                await self._ends.end_all([hold], f"could not be connected: {detail_of(error)}")
                if not isinstance(error, TimeoutError):
                    raise
                raise HardwareFault(f"{self.name} could not be connected to {hold.arc}: {detail_of(error)}") from error
            self._connects += 1
            self._lease_changed.set()
            self.story.note(order.arc, f"connected under epoch {order.epoch}")
            self._ends.report_holders()
        return Connected(order.epoch)

    def _heard_leases(self, envelope: Envelope[Leases]) -> None:
        leases = envelope.body
        until_s = min(envelope.stamp_s, self.clock.now_s()) + leases.lease_s
        mine = [lease for lease in leases.leases if lease.rc == self.name]
        for lease in mine:
            self.holds.renew(lease.arc, lease.epoch, until_s, lease.rank)
            self.ranked(lease.arc, lease.epoch)
        if self.name in leases.missing or any(self.holds.has_lost(lease.arc, lease.epoch) for lease in mine):
            self.changed()  # the published state corrects the RC manager
