"""The RC manager's loop: carries out what the schedule manager decides and reports back what happened.

Rules of this file:

* No decision about who runs: that is ``schedule_manager``'s. Here is only how.
* Nothing that matters lives only here. After a restart the RCs say who holds them, the ARCs what they ask for.

Source: RAM 2002, "The RC Scheduler".
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import assert_never

from backbone.addresses import DEPENDENCY_DATABASE, NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.component import CALM_S, Component
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Disappeared
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.beats import Beats
from backbone.rc_manager.context_switch import ContextSwitch, in_pool
from backbone.rc_manager.decision_log import DecisionLog
from backbone.rc_manager.hardware import Hardware
from backbone.rc_manager.messages import (
    RENEW_EVERY_S,
    AskAttributes,
    AskRequest,
    AskSchedule,
    AskSnapshot,
    AskUtilization,
    AskWhy,
    Beat,
    ChangeRuntime,
    CurrentRequest,
    Done,
    Extend,
    FixedRules,
    Leases,
    MoveNode,
    RcManagerQuestion,
    RcState,
    SetIdle,
    SetPriority,
    TakePath,
    Withdraw,
)
from backbone.rc_manager.rc_watch import RcWatch
from backbone.rc_manager.recovery import Found, Recovery, rc_known
from backbone.rc_manager.switch_times import SwitchTimes
from backbone.scheduling.events import (
    CapacityChanged,
    ConnectArc,
    Departed,
    Event,
    Extended,
    Freed,
    Idled,
    Instruction,
    NodeMoved,
    Opened,
    OpenFailed,
    PacketsMeasured,
    PriorityChanged,
    RcCameBack,
    RcWentDown,
    Record,
    RenewLeases,
    Requested,
    RevokeArc,
    RuntimeChanged,
    WakeAt,
    Wanted,
    Woken,
)
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.own_planner import load_planner
from backbone.scheduling.requests import (
    LEASE_S,
    Lease,
    PathNode,
    RcUse,
    Scheduled,
    SchedulingRequest,
    UnknownRequest,
)
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.views import Utilization
from backbone.waiting import end_tasks, set_within
from backbone.wire import Envelope, Message

log = logging.getLogger(__name__)

ARC_REPLY_S = 1.0  # chosen: an ARC answers in milliseconds; after this it hangs or is gone
CALM_EACH_S = 0.002  # chosen: of 100 ARCs five schedules a second, and people cannot read more
TOLERANCE_S = 0.05  # SCHEDULING.md, section 5: reaction and timer tolerance of real processes


class RcManagerParameters(SchedulingRules, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """For whom and with which rules the RC manager decides.

    Attributes:
        mission: Name of the mission's own node, root of the behavior tree.
        mission_priority: Its priority among the consoles.
        trace: File the decisions are written to; empty: none.
    """

    mission: str
    mission_priority: int = 0
    trace: str = ""

    def rules(self) -> SchedulingRules:
        """Return the rules alone."""
        return SchedulingRules(**{rule: getattr(self, rule) for rule in SchedulingRules.__struct_fields__})


class RcManager(Component[RcManagerParameters]):
    """Grants whole sets of RCs by priority and in turns, and says why."""

    parameters_type = RcManagerParameters
    accepts = RcManagerQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        given = self.parameters
        self.manager = ScheduleManager(
            given.rules(),
            tolerance_s=TOLERANCE_S,
            mission=given.mission,
            mission_priority=given.mission_priority,
            goes_on=bool(given.trace) and _has_lines(Path(given.trace)),
            planner=load_planner(given.planner),
        )
        self.answers = Answers(self.manager)
        self._uses: dict[str, Mapping[str, RcUse]] = {}
        self._beats = Beats(clock.rate)
        self._requesting: Counter[str] = Counter()
        self._switches: dict[str, asyncio.Task[None]] = {}
        self._wake = asyncio.Event()
        self._wake_at_s: float | None = None
        self._log = DecisionLog(bus, clock, self.manager, self.story.note, self._trace_stopped)
        self.shares = self._log.shares
        self._context_switch = ContextSwitch(bus, clock, self.story.note, self._may_leave)
        self._recovery = Recovery(bus, clock)
        self._rcs = RcWatch(self, self._context_switch, self._recovery)
        self._hardware = Hardware(self, self._recovery, self._rcs)
        self._resources = self._hardware.resources
        self._found = Found({}, {})
        self._switch_times = SwitchTimes()
        self._lines_published = 0

    # ------------------------------------------------------------------ life
    async def connect(self) -> None:
        """Learn the hardware and, after a restart, who holds it; then watch the nameserver for changes."""
        self._log.begin(self.parameters.trace)
        await self._hardware.learn()
        self._found = self._rcs.believed(await self._recovery.find(self._resources))
        await self._context_switch.disconnect(self._found.orphans(), "not adopted after a restart")

    async def serve(self) -> None:
        """Take over what was found; then wake when a decision is due, renew leases, publish changes."""
        self._take_over(self._found)
        self.bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard_from_nameserver)
        self.bus.subscribe(f"{Subsystem.RESOURCE_POOL}/*", Conversation.BEAT, Beat, self._heard_beat)
        self._hardware.follow()
        self.bus.watch_link(self._link_changed)
        async with asyncio.TaskGroup() as loops:
            loops.create_task(self._wake_when_due())
            loops.create_task(self._renew())
            loops.create_task(self._hardware.keep_comparing())

    def parameters_changed(self) -> None:
        """Refuse: a waiting ARC has a place by the rules as they are.

        Raises:
            FixedRules: Always.
        """
        raise FixedRules(f"{self.name} keeps the rules it began with")

    async def drain(self) -> None:
        """End all switches; what is held ends by lease, or is taken over by the next RC manager."""
        await end_tasks(*self._switches.values(), *self._rcs.starts)
        self._log.end()

    def statistics(self) -> dict[str, float]:
        """Count decisions and switches; switch times are from revoke to grant, settling not counted."""
        return {**self._switch_times.statistics(), "held": float(len(self.manager.leases()))}

    # ------------------------------------------------------------------ questions
    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ARCs, consoles and tools."""
        match asked.body:
            case SchedulingRequest() as request:
                return await self._request(request)
            case Withdraw(arc=arc, reason=reason):
                self._uses.pop(arc, None)
                self._beats.forget(arc)
                self.happened(Departed(arc, reason or "self"))
            case SetIdle(arc=arc, idle=idle):
                self.happened(Idled(arc) if idle else Wanted(arc))
            case ChangeRuntime(arc=arc, minimum_runtime_s=least, maximum_runtime_s=most):
                self.happened(RuntimeChanged(arc, least, most))
            case Extend(arc=arc, until_s=until_s):
                self.happened(Extended(arc, until_s))
            case SetPriority(node=node, priority=priority):
                self.happened(PriorityChanged(node, priority))
                self._tell_paths(node)
            case MoveNode(node=node, parent=parent):
                self.manager.require_movable(node, parent)
                self.happened(NodeMoved(node, parent))
                self._tell_paths(node)
            case AskSchedule():
                return self.answers.schedule(self.clock.now_s())
            case AskWhy(name=name):
                return self.answers.why(name, self.clock.now_s())
            case AskAttributes(name=name):
                return self.answers.attributes(name)
            case AskUtilization(periods=periods):
                now_s = self.clock.now_s()
                return Utilization(now_s, self.shares.utilizations(now_s, periods=periods))
            case AskSnapshot():
                return self._log.snapshot()
            case _:
                return await super().answer(asked)
        return Done()

    async def _request(self, request: SchedulingRequest) -> Scheduled:
        self._requesting[request.arc] += 1
        try:
            rcs = await self._hardware.choose(request)
            await self._rcs.have_running(rcs)
            self._admit(request, rcs)
        finally:
            self._requesting[request.arc] -= 1
        return self.answers.scheduled(request.arc, self.clock.now_s())

    def is_choosing(self) -> bool:
        """Return whether RCs were chosen for a request that the schedule manager does not have yet."""
        return self._requesting.total() > 0

    def _tell_paths(self, node: str) -> None:
        """Tell the ARCs at and below the node by which path they ask now: a later RC manager must hear of it."""
        with contextlib.suppress(UnknownRequest):  # it has no request yet
            for one in self.answers.attributes(node).requests:
                self.start_task(self._tell_path(one.arc, one.path), f"path of {one.arc}")

    async def _tell_path(self, arc: str, path: list[PathNode]) -> None:
        try:
            await self.bus.ask(in_pool(arc), TakePath(path), Done, within_s=ARC_REPLY_S)
        except (Refusal, LinkError) as error:
            self.story.note(arc, f"did not take its new path; the next RC manager would not know it: {error}")

    def _admit(self, request: SchedulingRequest, rcs: tuple[str, ...]) -> None:
        self._remember(request, rcs)
        self.happened(Requested(request, rcs))

    def _remember(self, request: SchedulingRequest, rcs: tuple[str, ...]) -> None:
        self._uses[request.arc] = next(uses for uses in request.alternatives if set(uses) == set(rcs))
        self._beats.heard(request.arc, self.clock.now_s())

    # ------------------------------------------------------------------ decide, then do
    def happened(self, event: Event, at_s: float | None = None) -> None:
        """Let the schedule manager decide on what happened, now unless told, and begin to carry out what it says."""
        at_s = self.clock.now_s() if at_s is None else at_s
        self._log.decides_on(event, at_s)
        instructions = self.manager.handle(event, at_s)
        for instruction in instructions:
            self._carry_out(instruction)
        if instructions:
            self.changed()

    def _carry_out(self, instruction: Instruction) -> None:
        match instruction:
            case Record():
                self._log.record(instruction)
            case WakeAt(at_s=at_s):
                self._wake_at_s = at_s
                self._wake.set()
            case ConnectArc(arc=arc):
                self._switch(arc, lambda: self._connect(instruction))
            case RevokeArc(arc=arc, epochs=epochs):
                self._switch_times.revoked(epochs, arc, self.clock.now_s())
                self._switch(arc, lambda: self._revoke(instruction))
            case RenewLeases():
                self._publish_leases()
            case _:
                assert_never(instruction)

    def _switch(self, arc: str, work: Callable[[], Coroutine[object, None, None]]) -> None:
        """Run the work after the work that is still under way for this ARC was ended."""
        before = self._switches.get(arc)

        async def in_turn() -> None:
            if before is not None and not before.done():
                await end_tasks(before)
            await work()
            if self._switches.get(arc) is asyncio.current_task():
                del self._switches[arc]

        self._switches[arc] = self.start_task(in_turn(), f"switch {arc}")

    def _trace_stopped(self) -> None:
        """Let people know; the mission goes on without a trace."""
        self.publish_event(self.name, self._log.why_no_trace, LogLevel.WARNING)
        self.changed()

    # ------------------------------------------------------------------ context switches
    async def _connect(self, order: ConnectArc) -> None:
        failed = await self._context_switch.connect(order, self._uses.get(order.arc, {}))
        if failed is None:
            self._switch_times.granted(order.epochs, order.arc, order.settle_s, self.clock.now_s())
            self.happened(Opened(order.arc))
            return
        self._rcs.failed(failed)
        self.happened(OpenFailed(order.arc, failed))
        if failed:
            self._rcs.meet_in_a_while(failed)

    async def _revoke(self, order: RevokeArc) -> None:
        release_s = max(self._resources[rc].disconnect_s for rc in order.epochs)
        for rc in await self._context_switch.revoke(order, self.parameters.grace_s + release_s):
            self._rcs.does_not_answer(rc)
        self.happened(Freed(order.arc))

    def _may_leave(self, rc: str, arc: str) -> bool:
        """Say whether nobody but this ARC would lose anything if the RC were down."""
        return rc not in self._rcs.up or all(lease.rc != rc or lease.arc == arc for lease in self.manager.leases())

    # ------------------------------------------------------------------ who is there
    def _take_over(self, found: Found) -> None:
        """Tell the schedule manager of all hardware, of the ARCs that hold it and of those that wait."""
        adopted = found.adopted(self._resources, self.clock.now_s())
        began_s = min((at_s for at_s, _ in adopted), default=self.clock.now_s())
        self._rcs.up.update(found.rcs)
        for resource in self._resources.values():
            self.shares.know(resource.name, began_s)
            self.happened(rc_known(resource, found.rcs.get(resource.name)), began_s)
        for at_s, event in adopted:
            self._remember(event.request, tuple(event.epochs))
            self.happened(event, at_s)
        for arc, current in found.arcs.items():
            if current.rcs and self._resources.keys() >= {*current.rcs} and not found.holds_rightly(arc):
                self._admit(current.request, tuple(current.rcs))
        for state in found.rcs.values():
            self._heard_of_packets(state)

    def _heard_from_nameserver(self, envelope: Envelope[Message]) -> None:
        match envelope.body:
            case Appeared(component=component):
                self._appeared(component_of(component.address), component.address)
            case Disappeared(address=gone):
                self._disappeared(component_of(gone))

    def _appeared(self, name: str, at: str) -> None:
        if name in self._resources and at.startswith("resource_pool/"):
            self._rcs.meet_again(name)
        elif at == DEPENDENCY_DATABASE:
            self._hardware.compare_soon()

    def heard_rc(self, envelope: Envelope[RcState]) -> None:
        """Correct what is believed of an RC by what it says itself: news of it, or a renewal, may have been lost."""
        state = envelope.body
        rc = state.name
        if not self._rcs.believes(state):
            return
        self.happened(CapacityChanged(rc, state.capacity))
        self._heard_of_packets(state)
        holds = {(holder.arc, holder.epoch) for holder in state.holders}
        if any(
            lease.rc == rc and lease.epoch <= state.last_epoch and (lease.arc, lease.epoch) not in holds
            for lease in self._leases()
            if lease.arc not in self._switches
        ):
            self.story.note(rc, "does not have all holds any more that it was given")
            self.happened(RcCameBack(rc, state.last_epoch))

    def _heard_of_packets(self, state: RcState) -> None:
        """Pass on which packets take longer than declared."""
        if state.measured:
            self.happened(PacketsMeasured(state.name, state.measured))

    def _leases(self) -> list[Lease]:
        """Return what is to be renewed: all that is held, but for what is just being given back."""
        return [lease for lease in self.manager.leases() if not self._context_switch.gives_back(lease.arc)]

    def _disappeared(self, name: str) -> None:
        if self._rcs.forget(name):
            self.happened(RcWentDown(name))
        elif name in self._uses:
            self._uses.pop(name)
            self._beats.forget(name)
            self.happened(Departed(name, "dead"))

    def _link_changed(self, up: bool) -> None:
        if up:
            self.start_task(self._compare_with_nameserver(), "compare")

    async def _compare_with_nameserver(self) -> None:
        """Catch up with what happened while this process had no link."""
        await self._hardware.compare()
        names = await self._recovery.present()
        for name in [*sorted(self._rcs.up), *self._uses]:
            if name not in names:
                self._disappeared(name)
        for rc in sorted(names & set(self._resources)):
            await self._rcs.meet(rc)

    # ------------------------------------------------------------------ loops
    async def _wake_when_due(self) -> None:
        while True:
            self._wake.clear()
            at_s = self._wake_at_s
            wait_s = None if at_s is None else max(0.0, at_s - self.clock.now_s()) / self.clock.rate
            if not await set_within(self._wake, wait_s):
                self._wake_at_s = None
                self.happened(Woken())

    async def _renew(self) -> None:
        """Renew the leases of ARCs whose beat is fresh; end the hold of those that hang."""
        rate = self.clock.rate
        while True:
            for arc, silent_s in self._beats.look(self.clock.now_s()).items():
                log.warning("%s has not beaten for %.1f s", arc, silent_s)
                self._uses.pop(arc, None)
                self.happened(Departed(arc, "silent"))
            self._publish_leases()
            self._hardware.let_go()
            self.changed()
            await self.clock.sleep_s(RENEW_EVERY_S * rate)

    def _publish_leases(self) -> None:
        leases = Leases(self._leases(), LEASE_S * self.clock.rate, self._rcs.missing())
        self.bus.publish(self.address, Conversation.LEASES, leases)

    def calm_s(self) -> float:
        """Wait longer the more ARCs there are: no switch waits for a schedule that is made for people."""
        return max(CALM_S, CALM_EACH_S * self._lines_published)

    def publish_news(self) -> None:
        """Publish the schedule, and how many run if that is news."""
        schedule = self.answers.schedule(self.clock.now_s())
        self._lines_published = len(schedule.requests)
        running = sum(1 for request in schedule.requests if request.state == "running")
        feedback = f"{running} of {len(schedule.requests)} ARCs run"
        if self._log.why_no_trace:
            feedback += f"; {self._log.why_no_trace}"
        if feedback != self.feedback:
            self.feedback = feedback
            super().publish_news()
        self.bus.publish(self.address, Conversation.SCHEDULE, schedule)

    def _heard_beat(self, envelope: Envelope[Beat]) -> None:
        arc = envelope.body.arc
        if arc in self._uses:
            self._beats.heard(arc, self.clock.now_s())
        elif arc not in self._switches and not self._requesting[arc]:
            self._switch(arc, lambda: self._meet_arc(arc))

    async def _meet_arc(self, arc: str) -> None:
        """Take an ARC back that beats but is not known: it hung, or its request was lost with an earlier manager."""
        current = (await self._recovery.ask_all([in_pool(arc)], AskRequest(), CurrentRequest)).get(arc)
        if current is None or arc in self._uses or self._requesting[arc]:
            return
        if current.rcs and self._resources.keys() >= {*current.rcs}:
            self._admit(current.request, tuple(current.rcs))
            return
        try:
            await self._request(current.request)  # its own question was lost, or is still on its way
        except (Refusal, LinkError) as error:
            self.story.note(arc, f"got no place in the schedule: {error}")


def _has_lines(trace: Path) -> bool:
    return trace.is_file() and trace.stat().st_size > 0
