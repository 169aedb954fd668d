"""Aggregate resource controller (ARC): a set of RCs that are useful only together.

An ARC requests its set from the RC manager, passes commands of its one owner while it holds the set, and notifies the
owner of the begin and end of a grant. If its owner dies or hangs, the ARC gives the set back, so an owner need not
release it. The ARC gets the same renewals as its RCs: when their leases expire, it closes its gate and notifies the
owner.

Source: RAM 2002, "Resource Pool" and "The RC Scheduler".
"""

from __future__ import annotations

import asyncio
import functools
import operator
from collections.abc import Mapping, Sequence
from typing import ClassVar, TypeVar

import msgspec

from backbone.addresses import DEPENDENCY_DATABASE, RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.abilities import Abilities
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.dependency_database.messages import FindRcs, RcSets
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRequest, CloseGate, GateClosed, GateOpens, Leases, OpenGate
from backbone.scheduling.requests import Usage
from backbone.scheduling.run_times import require_runtime
from backbone.waiting import set_within
from backbone.wire import Accepts, Envelope, Message, kinds_of
from resource_pool.arc_commands import ArcCommands
from resource_pool.arc_request import ROBOT, ArcParameters, request_of
from resource_pool.arc_slice import RC_REPLY_S, ArcSlice
from resource_pool.commands import Command
from resource_pool.gate import Gate
from resource_pool.manager_watch import ManagerWatch
from resource_pool.messages import (
    DEFAULT_DRIVE_USAGE,
    Accepted,
    Applied,
    ArcQuestion,
    ArcState,
    AskArc,
    GiveCommand,
    NeedsRestart,
    NoSuchAction,
    NotFromYou,
    NotYours,
    Release,
    Resumed,
    Suspended,
    Suspending,
    SwappedOut,
    WantIdle,
    WantLonger,
    WantRuntime,
)
from resource_pool.owner_notices import OwnerNotices
from resource_pool.owner_watch import OwnerWatch
from resource_pool.placed_request import RUN_TIMES, PlacedRequest
from resource_pool.set_lease import SetLease

W = TypeVar("W")

PREPARE_S = 0.9  # chosen: less than the RC manager's limit for the opening, so the gate opens in time or never


class AggregateResourceController(Component[ArcParameters]):
    """Base class of every ARC; derive, set ``roles``, ``commands`` and ``body``, override ``prepare``."""

    parameters_type = ArcParameters
    accepts: ClassVar[Accepts | None] = OpenGate | CloseGate | AskRequest | ArcQuestion
    roles: ClassVar[Mapping[str, str] | Sequence[str]] = ()
    """Role → kind of RC in its set; a sequence of kinds if each role is named like its kind."""
    commands: ClassVar[Mapping[type[Command], str | Sequence[str]]] = {}
    """Commands of its owner, each with the role of the RC that obeys it; of several roles the command names one."""
    body: ClassVar[str] = ""
    """Role of the RC that has a body; operators can stop this RC. Empty: none."""
    usage: ClassVar[Usage] = DEFAULT_DRIVE_USAGE
    """Default usage of the radio, for owners such as consoles that state none."""
    gives_pictures: ClassVar[bool] = False
    """True if pictures of its robot are published under its address."""

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        inherited = kinds_of(cls.accepts) if cls.accepts is not None else ()
        others = (kind for kind in inherited if not issubclass(kind, Command))  # a base may have other commands
        cls.accepts = functools.reduce(operator.or_, (*others, *cls.commands))

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._in_force, self._owner, note = self.parameters, self.parameters.owner, self.story.note
        self._gate = Gate(self.name)
        self._placed = PlacedRequest(bus, clock, self.name, changed=self._set_parameters, note=note)
        self._notices = OwnerNotices(bus, clock, self._owner, note)
        self._lease, self._leased = SetLease(self.name, clock.rate), asyncio.Event()
        self._slice = ArcSlice(bus, clock, self._gate, self._owner, longest_s=self._longest_s, note=note)
        self._owner_watch = OwnerWatch(bus, clock, self._owner, note)
        self._manager_watch = ManagerWatch(bus)
        self._able = ArcCommands(launch.type, self.commands, self.roles, self.body)
        self._offering: asyncio.Task[None] | None = None
        self._commands = self._refused = 0

    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Bring the connected RCs into the state that the owner expects.

        When: after the connection of all RCs, before they settle and before the gate opens. What: switch on, tune.
        Raise a ``Refusal`` or ``LinkError`` if an RC cannot: then the ARC gives the set back.
        """

    @classmethod
    def abilities(cls) -> Abilities:
        """Return the commands that the ARC passes on; see ``Component``."""
        return Abilities(
            gives_pictures=cls.gives_pictures,
            body=cls.body,
            commands=ArcCommands(cls.__name__, cls.commands, cls.roles, cls.body).forms(),
        )

    @classmethod
    def kinds(cls) -> dict[str, str]:
        """Return role → kind of RC, for the ARC's set."""
        return dict(cls.roles) if isinstance(cls.roles, Mapping) else {kind: kind for kind in cls.roles}

    def rc(self, role: str) -> str:
        """Return the name of the RC of this role.

        Raises:
            NoSuchAction: This kind of ARC has no such role.
            SwappedOut: No set is chosen yet.
        """
        if role not in self.roles:
            raise NoSuchAction(f"{self.launch.type} has no {role}", role=role)
        if role not in self._placed.rcs:
            raise SwappedOut(f"{self.name} has no {role} yet", reason=self._gate.reason, by="", expected_start_s=-1.0)
        return self._placed.rcs[role]

    @property
    def epochs(self) -> Mapping[str, int]:
        """RC → epoch of the open connections; empty while the gate is shut."""
        return self._gate.epochs if self._gate.is_open else {}

    async def tell_rc(self, role: str, epoch: int, command: Command) -> Applied:
        """Send a command to the RC of this role, under this epoch, and return what the RC applied."""
        at = address(Subsystem.RESOURCE_POOL, self.rc(role))
        return await self.bus.ask(at, command.under(self.name, epoch), Applied, within_s=RC_REPLY_S)

    async def connect(self) -> None:
        """Find the sets of RCs that match the claim.

        Raises:
            NoSuchHardware: No set matches.
        """
        given = self.parameters
        question = FindRcs(self.kinds(), self._by_role(given.wish), self._by_role(given.features))
        found = await ask_until_answered(
            self.bus, self.clock, DEPENDENCY_DATABASE, question, RcSets, each_s=2.0, within_s=10.0
        )
        request = request_of(self.name, self.parameters, found.sets, frozenset(found.sharable), self.usage)
        self._placed.make(request, found.sets)
        self.bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard_leases)

    async def serve(self) -> None:
        """Send the request, then watch owner and RC manager until the ARC ends."""
        self.start_task(self._notices.send(), "notify owner")
        self.start_task(self._end_without_owner(), "watch owner")
        self.start_task(self._beat(), "beat")
        self.start_task(self._watch_lease(), "watch lease")
        await self._send_request()
        self.start_task(self._manager_watch.watch(self._send_request), "watch RC manager")

    async def drain(self) -> None:
        """Give the set back."""
        self._gate.close("self", "", -1.0)
        await self._placed.withdraw()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Carry out orders of the RC manager for the gate, and orders of the owner for everything else."""
        match asked.body:
            case OpenGate() | CloseGate() | AskRequest() if asked.source != RC_MANAGER:
                raise NotFromYou(f"{self.name} does not take {type(asked.body).__name__} from {asked.source}")
            case OpenGate() as order:
                return await self._open(order)
            case CloseGate() as order:
                return await self._close(order, asked.stamp_s)
            case AskRequest():
                current = self._placed.current(self.epochs, self._gate.granted_s, self._slice.extended_until_s)
                self._manager_watch.asks()
                return current
            case AskArc():
                return self._arc_state()
            case _ if asked.source != self._owner:
                raise NotYours(f"{self.name} belongs to {self._owner}, not to {asked.source}", owner=self._owner)
            case Command() as command:
                return await self._command(command)
            case GiveCommand() as order:
                return await self._command(self._able.by_word(order))
            case WantIdle(idle=idle):
                await self._placed.set_idle(idle)
            case WantRuntime(minimum_runtime_s=least, maximum_runtime_s=most):
                await self._placed.set_run_times(least, most)
            case WantLonger(until_s=until_s):
                await self._slice.extend(until_s)
            case Release(reason=reason):
                self.end(f"released by {self._owner}: {reason}")
        return Accepted()

    def parameters_changed(self) -> None:
        """Use new run times from the next slice on, and send them to the RC manager.

        Raises:
            NeedsRestart: Another parameter than a run time changed.
            MissingRuntime: No slice can be planned with these run times.
        """
        before, now = self._in_force, self.parameters
        if fixed := {name for name in now.__struct_fields__ if getattr(before, name) != getattr(now, name)} - RUN_TIMES:
            raise NeedsRestart(f"{self.name} cannot change {', '.join(sorted(fixed))} while it runs")
        require_runtime(self.name, now.minimum_runtime_s, now.maximum_runtime_s)
        self._in_force = now
        if self._placed.request is not None:
            self._placed.ask_by({name: getattr(now, name) for name in RUN_TIMES})
            self._placed.sending = self.start_task(self._placed.send_run_times(), "send run times")

    def _by_role(self, wanted: Mapping[str, W]) -> dict[str, W]:
        return {self.body if role == ROBOT and self.body else role: value for role, value in wanted.items()}

    def _set_parameters(self, changed: Mapping[str, object]) -> None:
        self._manager_watch.request_changed()
        self._in_force = self.parameters = msgspec.structs.replace(self.parameters, **changed)

    def statistics(self) -> dict[str, float]:
        """Count commands that passed, and commands refused because the gate was shut."""
        return {"commands": self._commands, "refused_swapped_out": self._refused}

    async def _send_request(self) -> None:
        """Send the request to the RC manager; end if the RC manager refuses it."""
        try:
            scheduled = await self._placed.send()
        except (Refusal, LinkError) as error:
            placeless = f"got no place in the schedule: {error}"
            self.publish_event(self.name, placeless, LogLevel.WARNING)
            await self._notices.notify(Suspended(self.name, placeless, "", -1.0)).wait()
            self.end(placeless)
            return
        self._placed.choose(scheduled.rcs)
        behind = f", behind {', '.join(scheduled.blockers)}" if scheduled.blockers else ""
        place = f", place {scheduled.position} in line" if scheduled.position else ""
        self.story.note(self.name, f"is {scheduled.state}{place}{behind}")

    async def _open(self, order: OpenGate) -> GateOpens:
        self._placed.choose(order.epochs)
        if self._gate.epochs == order.epochs:  # the same order came twice: the first continues
            if self._gate.is_open:
                return GateOpens()
            reason = "is being opened already"
            raise SwappedOut(f"{self.name} {reason}", reason=reason, by=self.name, expected_start_s=-1.0)
        if self._gate.is_open:  # the order to close it was lost
            self._shut("connected anew", "rc_manager", -1.0)
        self._gate.prepare(order.epochs)
        self._lease.begin(self.clock.now_s())
        self._leased.set()
        try:
            async with asyncio.timeout(PREPARE_S):
                await self.prepare(order.epochs)
        except (Refusal, LinkError, TimeoutError) as error:
            detail = f"not within {PREPARE_S} s" if isinstance(error, TimeoutError) else str(error)
            reason = f"could not be prepared: {detail}"
            if self._gate.epochs == order.epochs:
                self._gate.close(reason, self.name, -1.0)
            self.publish_event(self.name, reason, LogLevel.WARNING)
            raise SwappedOut(f"{self.name} {reason}", reason=reason, by=self.name, expected_start_s=-1.0) from error
        if self._gate.epochs != order.epochs:
            raise SwappedOut(f"{self.name} was closed while it prepared", reason=self._gate.reason, by=self._gate.by)
        if self.clock.now_s() < order.settled_s:
            self.start_task(self._open_when_settled(order), "open")
        else:
            self._let_through(order)
        return GateOpens()

    async def _open_when_settled(self, order: OpenGate) -> None:
        await self.clock.sleep_until_s(order.settled_s)
        self._let_through(order)

    def _let_through(self, order: OpenGate) -> None:
        """Open the gate and notify the owner, unless the gate was closed meanwhile."""
        if not self._gate.open(order.epochs, self.clock.now_s()):
            return
        self._slice.begin(max(order.until_s, self._gate.granted_s + self.parameters.minimum_runtime_s))
        self.report(f"granted: {', '.join(self._placed.rcs.values())}")
        rcs, robot = self._placed.rcs, self._placed.rc_of(self.body)
        noted = self._notices.notify(Resumed(self.name, rcs, order.epochs, order.until_s, robot))
        if self.parameters.may_say_not_now:
            self._offering = self.start_task(self._slice.offer(noted), "offer more")

    async def _close(self, order: CloseGate, ordered_s: float) -> GateClosed:
        closing = self._gate.epochs
        if order.deadline_s > 0 and self._gate.is_open:
            notice = Suspending(self.name, order.reason, order.by, order.deadline_s)
            within_s = order.deadline_s / self.clock.rate
            if not await set_within(self._notices.notify(notice, within_s), within_s):
                self.story.note(self._owner, "was not ready when its time to stop cleanly was over")
        if self._gate.epochs == closing:  # the RC manager may not have waited, and have connected the ARC anew
            self._shut(order.reason, order.by, order.expected_s)
            self._lease.end(closing, ordered_s)
        return GateClosed()

    def _shut(self, reason: str, by: str, expected_s: float) -> None:
        """Close the gate, and notify the owner if it was open."""
        was_open, granted_s = self._gate.is_open, self._gate.granted_s
        self._gate.close(reason, by, expected_s)
        if self._offering is not None:
            self._offering.cancel()
            self._offering = None
        self.report(f"swapped out: {reason}{f' by {by}' if by else ''}")
        if was_open:
            self._placed.slice_ended(granted_s)
            self._notices.notify(Suspended(self.name, reason, by, expected_s))

    def _longest_s(self) -> float:
        return max(self.parameters.minimum_runtime_s, self.parameters.maximum_runtime_s)

    async def _command(self, command: Command) -> Applied:
        role = self._able.role_of(command)
        try:
            epoch = self._gate.epoch_of(self.rc(role))
        except SwappedOut:
            self._refused += 1
            raise
        self._commands += 1
        return await self.tell_rc(role, epoch, command)

    def _arc_state(self) -> ArcState:
        gate = self._gate
        return ArcState(
            arc=self.name,
            kind=self.launch.type,
            owner=self._owner,
            rcs=self._placed.rcs,
            granted=gate.is_open,
            epochs=dict(gate.epochs) if gate.is_open else {},
            reason=gate.reason,
            by=gate.by,
            expected_start_s=gate.expected_s,
            robot=self._placed.rc_of(self.body),
        )

    async def _end_without_owner(self) -> None:
        self.end(await self._owner_watch.wait_gone())

    async def _beat(self) -> None:
        """Publish heartbeats; end if the owner does not know this ARC."""
        while not (why := await self._owner_watch.beat(self._arc_state())):
            await self._owner_watch.wait_turn()
        self.end(why)

    def _heard_leases(self, envelope: Envelope[Leases]) -> None:
        self._owner_watch.leases_renewed()
        if self._lease.heard(envelope.body, envelope.stamp_s, self._gate.epochs):
            self.publish_event(self.name, "is counted as running and holds nothing: sends its request again")
            self.start_task(self._ask_anew(), "ask anew")

    async def _watch_lease(self) -> None:
        """Close the gate when the leases expire, because the RCs go to their safe states and the owner must know."""
        while True:
            self._leased.clear()
            if not self._gate.epochs:
                await self._leased.wait()
                continue
            await self.clock.sleep_until_s(self._lease.until_s)
            if self._gate.epochs and self.clock.now_s() >= self._lease.until_s:
                self.publish_event(self.name, "its lease expired: no renewal came in time", LogLevel.WARNING)
                self._shut("lease", "rc_manager", -1.0)
                if self._manager_watch.is_there:
                    await self._ask_anew()

    async def _ask_anew(self) -> None:
        """Withdraw the holds that the RC manager still has on record, and send the request again."""
        if await self._placed.withdraw_all():
            await self._send_request()
