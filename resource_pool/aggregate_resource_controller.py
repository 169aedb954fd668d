"""Aggregate resource controller (ARC): a set of RCs that are useful only together.

An ARC requests its set from the RC manager, passes commands of its one owner while it holds the set, and notifies the
owner of the begin and end of a grant. If its owner dies or hangs, the ARC gives the set back, so an owner need not
release it. The ARC gets the same renewals as its RCs: when their leases expire, it closes its gate and notifies the
owner.

Source: RAM 2002, "Resource Pool" and "The RC Scheduler".
"""

from __future__ import annotations

import asyncio
import logging
import math
import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import msgspec

from backbone.addresses import DEPENDENCY_DATABASE, RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.component.peer_monitor import PeerMonitor
from backbone.dependency_database.messages import FindRcs, RcSets
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import (
    BEAT_EVERY_S,
    AskRequest,
    Beat,
    ChangeRuntime,
    CloseGate,
    CurrentRequest,
    Done,
    Extend,
    GateClosed,
    GateOpens,
    Leases,
    OpenGate,
    SetIdle,
    TakePath,
    Withdraw,
)
from backbone.scheduling.claims import STREAMED_KINDS, scheduling_request
from backbone.scheduling.requests import (
    LEASE_S,
    MissingRuntime,
    PathNode,
    Scheduled,
    SchedulingRequest,
    UnknownRequest,
    Usage,
)
from backbone.wire import Envelope, Message
from resource_pool.gate import Gate
from resource_pool.messages import (
    Accepted,
    Applied,
    ArcQuestion,
    ArcState,
    AskArc,
    AskBeat,
    CommandScout,
    Drive,
    Halt,
    Jump,
    NeedsRestart,
    NoSuchAction,
    Noted,
    NotFromYou,
    NotMySet,
    NotYours,
    Release,
    Resumed,
    SliceEnds,
    Suspended,
    Suspending,
    SwappedOut,
    WantIdle,
    WantLonger,
    WantRuntime,
)

log = logging.getLogger(__name__)

RC_REPLY_S = 0.8  # chosen: a robot RC itself gives the radio half a second
OWNER_GONE_S = 0.5  # chosen: a robot is free within a second of its console's death; a new hub is found sooner
OWNER_BEAT_S = 0.9  # chosen: less than the RC manager's limit of 1 s for a beat, with one beat to spare
PREPARE_S = 0.9  # chosen: less than the RC manager's limit for the opening, so the gate opens in time or never
NOTICE_S = 1.0  # chosen: an owner that needs longer fails its beat too
NOTICE_AGAIN_S = 0.1  # chosen: a restarted hub is back after a few attempts; machine seconds
REQUEST_EACH_S, REQUEST_WITHIN_S = 30.0, 60.0  # chosen: the RC manager may first ask for the start of RCs
ASK_BEFORE_END_S = 0.2  # chosen: question and answer take milliseconds, and a later answer is more accurate
RUN_TIMES = frozenset({"minimum_runtime_s", "maximum_runtime_s"})  # parameters that may change while it runs
ASKED_AGAIN_S = 1.0  # chosen: a restarted RC manager asks every ARC at once; after this it has missed one


class ArcParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Request and owner of an ARC; see ``arc_client.claim_parameters``.

    Attributes:
        owner: Address of the decision process.
        path: Names and priorities from the mission's root to the owner, or of the console alone.
        console: True for consoles.
        minimum_runtime_s: Shortest useful time, seconds.
        maximum_runtime_s: End of extensions; 0: the minimum.
        wish: Kind of RC → name.
        features: Kind of RC → features.
        usage: Period, packet time, deadline, jitter (seconds) and kind of the packets on the radio.
        further_usages: The same for each further kind of packet.
        idle: True: the owner wants no time yet.
        stops_at_once: True: the owner needs no time to stop at the end of a slice.
        may_say_not_now: True: ask the owner shortly before the end of a slice that can be extended.
    """

    owner: str
    path: list[tuple[str, int]]
    minimum_runtime_s: float
    maximum_runtime_s: float = 0.0
    console: bool = False
    wish: dict[str, str] = {}
    features: dict[str, list[str]] = {}
    usage: tuple[float, float, float, float, str] = (0.05, 0.002, 0.0, 0.0, "drive")
    further_usages: list[tuple[float, float, float, float, str]] = []
    idle: bool = False
    stops_at_once: bool = False
    may_say_not_now: bool = False


@dataclass(frozen=True, slots=True)
class _Notice:
    """A notice to the owner, the time limit of its answer (machine seconds), and the event of its end."""

    notice: Resumed | Suspending | Suspended
    within_s: float
    done: asyncio.Event


class AggregateResourceController(Component[ArcParameters]):
    """Base class of every ARC; derive, set ``roles``, override ``prepare``."""

    parameters_type = ArcParameters
    accepts: ClassVar[types.UnionType | type[Any] | None] = OpenGate | CloseGate | AskRequest | TakePath | ArcQuestion
    roles: ClassVar[Sequence[str]] = ()
    """Kinds of RC in its set, one of each."""
    sharable_roles: ClassVar[frozenset[str]] = STREAMED_KINDS
    """Kinds of RC that it uses by streams instead of exclusively."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._in_force = self.parameters
        self._owner = self.parameters.owner
        self._gate = Gate(self.name)
        self._request: SchedulingRequest | None = None
        self._sets: list[dict[str, str]] = []
        self._rcs: dict[str, str] = {}
        self._asked = asyncio.Event()
        self._sending: asyncio.Task[None] | None = None
        self._notices: asyncio.Queue[_Notice] = asyncio.Queue()
        self._lease_until_s = 0.0
        self._leased = asyncio.Event()
        self._slice_end_s = 0.0
        self._offering: asyncio.Task[None] | None = None
        self._unfounded: dict[str, int] = {}
        self._unfounded_since_s = 0.0
        self._manager: PeerMonitor | None = None
        self._commands = self._refused = 0

    # ------------------------------------------------------------------ hooks
    async def prepare(self, epochs: Mapping[str, int]) -> None:
        """Bring the connected RCs into the state that the owner expects.

        When: after the connection of all RCs, before they settle and before the gate opens. What: switch on, tune.
        Raise a ``Refusal`` or ``LinkError`` if an RC cannot: then the ARC gives the set back.
        """

    # ------------------------------------------------------------------ for derived classes
    def rc(self, role: str) -> str:
        """Return the name of the RC of this role.

        Raises:
            NoSuchAction: This kind of ARC has no such role.
            SwappedOut: No set is chosen yet.
        """
        if role not in self.roles:
            raise NoSuchAction(f"{self.launch.type} has no {role}", role=role)
        if role not in self._rcs:
            raise SwappedOut(f"{self.name} has no {role} yet", reason=self._gate.reason, by="", expected_start_s=-1.0)
        return self._rcs[role]

    @property
    def epochs(self) -> Mapping[str, int]:
        """RC → epoch of the open connections; empty while the gate is shut."""
        return self._gate.epochs if self._gate.is_open else {}

    async def tell_rc(self, role: str, command: Message) -> Applied:
        """Send a command to the RC of this role and return what the RC applied."""
        at = address(Subsystem.RESOURCE_POOL, self.rc(role))
        return await self.bus.ask(at, command, Applied, within_s=RC_REPLY_S)

    # ------------------------------------------------------------------ life
    async def connect(self) -> None:
        """Find the sets of RCs that match the claim.

        Raises:
            NoSuchHardware: No set matches.
        """
        given = self.parameters
        question = FindRcs(list(self.roles), given.wish, given.features)
        found = await ask_until_answered(
            self.bus, self.clock, DEPENDENCY_DATABASE, question, RcSets, each_s=2.0, within_s=10.0
        )
        self._sets = found.sets
        self._request = self._make_request()
        self.bus.subscribe(RC_MANAGER, Conversation.LEASES, Leases, self._heard_leases)

    async def serve(self) -> None:
        """Send the request, then watch owner and RC manager until the ARC ends."""
        self.start_task(self._send_notices(), "notify owner")
        self.start_task(self._watch_owner(), "watch owner")
        self.start_task(self._beat(), "beat")
        self.start_task(self._watch_lease(), "watch lease")
        await self._send_request()
        self.start_task(self._watch_rc_manager(), "watch RC manager")

    async def drain(self) -> None:
        """Give the set back."""
        self._gate.close("self", "", -1.0)
        if self._request is not None:
            try:
                await self.bus.ask(RC_MANAGER, Withdraw(self.name, "self"), Done, within_s=RC_REPLY_S)
            except (LinkError, Refusal) as error:  # its RCs are freed by this ARC's death or when their leases expire
                log.info("not withdrawn: %s", error)

    async def answer(self, asked: Envelope[Any]) -> Message:
        """Obey the RC manager for the gate, and the owner for everything else."""
        match asked.body:
            case OpenGate() | CloseGate() | AskRequest() | TakePath() if asked.source != RC_MANAGER:
                raise NotFromYou(f"{self.name} does not take {type(asked.body).__name__} from {asked.source}")
            case OpenGate() as order:
                return await self._open(order)
            case CloseGate() as order:
                return await self._close(order)
            case AskRequest():
                return self._current_request()
            case TakePath(path=path):
                return self._take_path(path)
            case AskArc():
                return self._arc_state()
            case _ if asked.source != self._owner:
                raise NotYours(f"{self.name} belongs to {self._owner}, not to {asked.source}", owner=self._owner)
            case Drive() | Halt() | Jump() as command:
                return await self._command(command)
            case WantIdle(idle=idle):
                await self._change_request(SetIdle(self.name, idle), idle=idle)
            case WantRuntime(minimum_runtime_s=least, maximum_runtime_s=most):
                self._require_runtime(least, most)
                change = ChangeRuntime(self.name, least, most)
                await self._change_request(change, minimum_runtime_s=least, maximum_runtime_s=most)
            case WantLonger(until_s=until_s):
                await self._extend(until_s)
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
        fixed = {name for name in now.__struct_fields__ if getattr(before, name) != getattr(now, name)} - RUN_TIMES
        if fixed:
            raise NeedsRestart(f"{self.name} cannot change {', '.join(sorted(fixed))} while it runs")
        self._require_runtime(now.minimum_runtime_s, now.maximum_runtime_s)
        self._in_force = now
        if self._request is not None:
            self._ask_by({name: getattr(now, name) for name in RUN_TIMES})
            self._sending = self.start_task(self._send_run_times(), "send run times")

    def statistics(self) -> dict[str, float]:
        """Count commands that passed, and commands refused because the gate was shut."""
        return {"commands": self._commands, "refused_swapped_out": self._refused}

    # ------------------------------------------------------------------ asking for run time
    def _make_request(self) -> SchedulingRequest:
        given = self.parameters
        return scheduling_request(
            self.name,
            self._sets,
            owner=self._owner,
            path=given.path,
            streams=[Usage(*usage) for usage in (given.usage, *given.further_usages)],
            streamed=self.sharable_roles,
            minimum_runtime_s=given.minimum_runtime_s,
            maximum_runtime_s=given.maximum_runtime_s,
            console=given.console,
            idle=given.idle,
            stops_at_once=given.stops_at_once,
        )

    async def _send_request(self) -> None:
        """Send the request to the RC manager; end if the RC manager refuses it."""
        request = self._request
        assert request is not None  # noqa: S101  made in connect
        try:
            scheduled = await ask_until_answered(
                self.bus,
                self.clock,
                RC_MANAGER,
                request,
                Scheduled,
                each_s=REQUEST_EACH_S,
                within_s=REQUEST_WITHIN_S,
            )
        except (Refusal, LinkError) as error:
            placeless = f"got no place in the schedule: {error}"
            self.publish_event(self.name, placeless, LogLevel.WARNING)
            await self._notify(Suspended(self.name, placeless, "", -1.0)).wait()
            self.end(placeless)
            return
        self._choose(scheduled.rcs)
        behind = f", behind {', '.join(scheduled.blockers)}" if scheduled.blockers else ""
        place = f", place {scheduled.position} in line" if scheduled.position else ""
        self.story.note(self.name, f"is {scheduled.state}{place}{behind}")

    def _choose(self, rcs: Iterable[str]) -> None:
        """Record the set that the RC manager chose.

        Raises:
            NotMySet: The set is no alternative of the request.
        """
        wanted = set(rcs)
        found = [by_role for by_role in self._sets if set(by_role.values()) == wanted]
        if not found:
            raise NotMySet(f"{self.name} asked for no such set: {', '.join(sorted(wanted)) or 'nothing'}")
        self._rcs = found[0]

    def _require_runtime(self, least_s: float, most_s: float) -> None:
        """Refuse run times that no slice can have, because a later RC manager would refuse the whole request.

        Raises:
            MissingRuntime: No slice can have these run times.
        """
        if not (0 < least_s < math.inf and (most_s == 0 or least_s <= most_s < math.inf)):
            raise MissingRuntime(f"{self.name} asks for at least {least_s:g} s and at most {most_s:g} s", arc=self.name)

    async def _change_request(self, wish: Message, **changed: bool | float) -> None:
        """Change the request; the RC manager and its successors get the change.

        Raises:
            Refusal: The RC manager refused; the request is unchanged.
            LinkError: The RC manager did not answer. The change stays, and the next RC manager gets it.
        """
        request = self._request
        assert request is not None  # noqa: S101  made in connect
        before = {name: getattr(request, name) for name in changed}
        self._ask_by(changed)
        try:
            await self._ask_rc_manager(wish)
        except Refusal:
            self._ask_by(before)
            raise

    def _ask_by(self, changed: Mapping[str, bool | float]) -> None:
        """Change request and parameters together, so that the parameters show the present request."""
        assert self._request is not None  # noqa: S101  made in connect
        if self._sending is not None:
            self._sending.cancel()  # its run times are outdated
        self._request = msgspec.structs.replace(self._request, **changed)
        self._in_force = self.parameters = msgspec.structs.replace(self.parameters, **changed)

    def _take_path(self, path: list[PathNode]) -> Done:
        if self._request is not None:
            self._request = msgspec.structs.replace(self._request, path=path)
        names_and_numbers = [(node.name, node.priority) for node in path]
        self._in_force = self.parameters = msgspec.structs.replace(self.parameters, path=names_and_numbers)
        return Done()

    async def _send_run_times(self) -> None:
        request = self._request
        assert request is not None  # noqa: S101  made in connect
        change = ChangeRuntime(self.name, request.minimum_runtime_s, request.maximum_runtime_s)
        try:
            await ask_until_answered(
                self.bus, self.clock, RC_MANAGER, change, Done, each_s=RC_REPLY_S, within_s=REQUEST_WITHIN_S
            )
        except (Refusal, LinkError) as error:  # the next RC manager gets them with the request
            self.story.note(self.name, f"the RC manager did not accept its run times: {error}")

    async def _ask_rc_manager(self, wish: Message) -> None:
        await self.bus.ask(RC_MANAGER, wish, Done, within_s=RC_REPLY_S)

    def _current_request(self) -> CurrentRequest:
        if self._request is None:
            raise UnknownRequest(f"{self.name} has no request yet")
        self._asked.set()
        return CurrentRequest(
            self._request,
            list(self._rcs.values()),
            dict(self._gate.epochs) if self._gate.is_open else {},
            self._gate.granted_s,
        )

    # ------------------------------------------------------------------ the gate
    async def _open(self, order: OpenGate) -> GateOpens:
        self._choose(order.epochs)
        if self._gate.epochs == order.epochs:  # the same order came twice: the first continues
            if self._gate.is_open:
                return GateOpens()
            reason = "is being opened already"
            raise SwappedOut(f"{self.name} {reason}", reason=reason, by=self.name, expected_start_s=-1.0)
        if self._gate.is_open:  # the order to close it was lost
            self._shut("connected anew", "rc_manager", -1.0)
        self._gate.prepare(order.epochs)
        self._lease_until_s = self.clock.now_s() + LEASE_S * self.clock.rate
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
        self._slice_end_s = max(order.until_s, self._gate.granted_s + self.parameters.minimum_runtime_s)
        self.report(f"granted: {', '.join(self._rcs.values())}")
        noted = self._notify(Resumed(self.name, self._rcs, order.epochs, order.until_s))
        if self.parameters.may_say_not_now:
            self._offering = self.start_task(self._offer_more(noted), "offer more")

    async def _close(self, order: CloseGate) -> GateClosed:
        if order.deadline_s > 0 and self._gate.is_open:
            notice = Suspending(self.name, order.reason, order.by, order.deadline_s)
            within_s = order.deadline_s / self.clock.rate
            try:
                async with asyncio.timeout(within_s):
                    await self._notify(notice, within_s).wait()
            except TimeoutError:
                self.story.note(self._owner, "was not ready when its time to stop cleanly was over")
        self._shut(order.reason, order.by, order.expected_s)
        return GateClosed()

    def _shut(self, reason: str, by: str, expected_s: float) -> None:
        """Close the gate, and notify the owner if it was open."""
        was_open = self._gate.is_open
        self._gate.close(reason, by, expected_s)
        if self._offering is not None:
            self._offering.cancel()
            self._offering = None
        self.report(f"swapped out: {reason}{f' by {by}' if by else ''}")
        if was_open:
            self._notify(Suspended(self.name, reason, by, expected_s))

    # ------------------------------------------------------------------ extension of a slice
    async def _offer_more(self, resumed: asyncio.Event) -> None:
        """Ask the owner shortly before the end of its slice whether it needs more time, and request the extension.

        The owner is asked again before the end of an extension. It is not asked after the RC manager has ended the
        slice, because the RCs are then reserved for others.
        """
        await resumed.wait()
        while self._slice_end_s < self._longest_end_s():
            ask_s = self._slice_end_s - ASK_BEFORE_END_S
            if self.clock.now_s() < ask_s:
                await self.clock.sleep_until_s(ask_s)
                continue  # it may have been extended meanwhile
            wanted_s = await self._ask_whether_not_now()
            if not wanted_s > 0:
                return
            try:
                await self._extend(self._slice_end_s + max(wanted_s, ASK_BEFORE_END_S))
            except (LinkError, Refusal) as error:
                self.story.note(self.name, f"its slice was not extended: {error}")
                return

    async def _ask_whether_not_now(self) -> float:
        question = SliceEnds(self.name, self._slice_end_s, self._longest_end_s())
        within_s = ASK_BEFORE_END_S / self.clock.rate
        try:
            return (await self.bus.ask(self._owner, question, Noted, within_s=within_s)).wanted_s
        except (LinkError, Refusal) as error:
            self.story.note(self._owner, f"did not answer whether its slice may end: {error}")
            return 0.0

    async def _extend(self, until_s: float) -> None:
        """Request the extension of the slice until this time, at most the maximum run time from the grant on."""
        until_s = min(until_s, self._longest_end_s())
        await self._ask_rc_manager(Extend(self.name, until_s))
        self._slice_end_s = max(self._slice_end_s, until_s)

    def _longest_end_s(self) -> float:
        given = self.parameters
        return self._gate.granted_s + max(given.minimum_runtime_s, given.maximum_runtime_s)

    async def _command(self, command: Drive | Halt | Jump) -> Applied:
        try:
            scout = self.rc("scout")
            epoch = self._gate.epoch_of(scout)
        except SwappedOut:
            self._refused += 1
            raise
        self._commands += 1
        return await self.tell_rc("scout", CommandScout(self.name, epoch, command))

    def _arc_state(self) -> ArcState:
        gate = self._gate
        return ArcState(
            arc=self.name,
            kind=self.launch.type,
            owner=self._owner,
            rcs=self._rcs,
            granted=gate.is_open,
            epochs=dict(gate.epochs) if gate.is_open else {},
            reason=gate.reason,
            by=gate.by,
            expected_start_s=gate.expected_s,
        )

    def _notify(self, notice: Resumed | Suspending | Suspended, within_s: float = NOTICE_S) -> asyncio.Event:
        """Queue a notice after all earlier ones; the event is set when the owner noted it or the limit expired."""
        noted = asyncio.Event()
        self._notices.put_nowait(_Notice(notice, within_s, noted))
        return noted

    async def _send_notices(self) -> None:
        """Send one notice after the other, so that no notice overtakes another on its way to a slow owner."""
        while True:
            waiting = await self._notices.get()
            await self._send_until_noted(waiting)
            waiting.done.set()

    async def _send_until_noted(self, waiting: _Notice) -> None:
        """Repeat a notice, which may get lost, until the owner notes it or a newer notice waits.

        Other checks detect an owner that hangs or is gone.
        """
        while True:
            try:
                await self.bus.ask(self._owner, waiting.notice, Noted, within_s=waiting.within_s)
                return
            except Refusal as refusal:
                self.story.note(self._owner, f"did not note {type(waiting.notice).__name__}: {refusal}")
                return
            except LinkError as error:
                self.story.note(self._owner, f"did not note {type(waiting.notice).__name__}: {error}")
            if isinstance(waiting.notice, Suspending) or not self._notices.empty():
                return
            await self.clock.sleep_s(NOTICE_AGAIN_S * self.clock.rate)

    # ------------------------------------------------------------------ watching
    def _heard_leases(self, envelope: Envelope[Any]) -> None:
        """Extend the lease of the set if all its RCs were renewed."""
        leases: Leases = envelope.body
        renewed = {lease.rc: lease.epoch for lease in leases.leases if lease.arc == self.name}
        if self._gate.epochs and self._gate.epochs.items() <= renewed.items():
            self._lease_until_s = max(self._lease_until_s, envelope.stamp_s + leases.lease_s)
        self._doubt(renewed if not self._gate.epochs else {}, envelope.stamp_s)

    def _doubt(self, unfounded: dict[str, int], now_s: float) -> None:
        """Send the request again if the RC manager renews a hold for a whole lease that this ARC does not have.

        The hold may belong to an earlier ARC of this name. For a shorter time it may be one that is about to open.
        """
        if unfounded != self._unfounded:
            self._unfounded, self._unfounded_since_s = unfounded, now_s
        elif unfounded and now_s - self._unfounded_since_s >= LEASE_S * self.clock.rate:
            self._unfounded = {}
            self.publish_event(self.name, "is counted as running and holds nothing: sends its request again")
            self.start_task(self._ask_anew(), "ask anew")

    async def _watch_lease(self) -> None:
        """Close the gate when the leases expire, because the RCs go to their safe states and the owner must know."""
        while True:
            self._leased.clear()
            if not self._gate.epochs:
                await self._leased.wait()
                continue
            await self.clock.sleep_until_s(self._lease_until_s)
            if self._gate.epochs and self.clock.now_s() >= self._lease_until_s:
                self.publish_event(self.name, "its lease expired: no renewal came in time", LogLevel.WARNING)
                self._shut("lease", "rc_manager", -1.0)
                if self._manager is not None and self._manager.is_there:
                    await self._ask_anew()

    async def _ask_anew(self) -> None:
        """Withdraw the holds that the RC manager still counts, and send the request again."""
        gone = Withdraw(self.name, "lease")
        try:
            await ask_until_answered(
                self.bus, self.clock, RC_MANAGER, gone, Done, each_s=RC_REPLY_S, within_s=REQUEST_WITHIN_S
            )
        except Refusal as unknown:  # the RC manager has restarted meanwhile
            log.info("not withdrawn: %s", unknown)
        except LinkError:  # the RC manager is gone: its successor asks
            return
        await self._send_request()

    async def _watch_owner(self) -> None:
        owner = PeerMonitor(self.bus, self._owner, gone_after_s=OWNER_GONE_S)
        try:
            await owner.wait_gone()
        finally:
            owner.close()
        self.end(f"its owner {self._owner} is gone")

    async def _beat(self) -> None:
        """Publish a heartbeat while this ARC and its owner live."""
        while True:
            try:
                await self.bus.ask(self._owner, AskBeat(self._arc_state()), Noted, within_s=OWNER_BEAT_S)
            except Refusal as refusal:
                self.end(f"its owner does not know it: {refusal.detail}")
            except LinkError as error:
                self.story.note(self._owner, f"does not answer: {error}")
            else:
                self.bus.publish(self.address, Conversation.BEAT, Beat(self.name))
            await self.clock.sleep_s(BEAT_EVERY_S * self.clock.rate)

    async def _watch_rc_manager(self) -> None:
        """Send the request again if a restarted RC manager has not asked for it."""
        manager = self._manager = PeerMonitor(self.bus, RC_MANAGER)
        try:
            await manager.wait_there()
            while True:
                self._asked.clear()
                await manager.wait_risen(manager.times_risen + 1)
                try:
                    async with asyncio.timeout(ASKED_AGAIN_S):
                        await self._asked.wait()
                except TimeoutError:
                    await self._send_request()
        finally:
            self._manager = None
            manager.close()
