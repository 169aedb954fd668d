"""The RC manager's loop: carries out what the schedule manager decides and reports back what happened.

Rules of this file:

* ``schedule_manager`` decides which ARCs run. This file only carries its decisions out.
* No essential state exists only here. After a restart, the RCs report their holders, and the ARCs their requests.

Source: RAM 2002, "The RC Scheduler".
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import assert_never

from backbone.addresses import DEPENDENCY_DATABASE, NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.component import CALM_S, Component
from backbone.component.launch import Launch
from backbone.component.messages import Absence, LogLevel
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Disappeared
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.arc_switches import ArcSwitches
from backbone.rc_manager.arc_watch import ArcWatch
from backbone.rc_manager.changed_tree import ChangedTree
from backbone.rc_manager.context_switch import ContextSwitch
from backbone.rc_manager.decision_log import DecisionLog
from backbone.rc_manager.failures import Failures
from backbone.rc_manager.hardware import Hardware
from backbone.rc_manager.messages import (
    RENEW_EVERY_S,
    AskAttributes,
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
    Withdraw,
)
from backbone.rc_manager.parameters import RcManagerParameters
from backbone.rc_manager.rc_watch import RcWatch
from backbone.rc_manager.recovery import Found, Recovery, has_its_rcs, rc_known
from backbone.scheduling.events import (
    CapacityChanged,
    ConnectArc,
    Departed,
    Event,
    Extended,
    Idled,
    Instruction,
    KeptTree,
    NodeMoved,
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
from backbone.scheduling.requests import LEASE_S, Lease, RequestState, Scheduled, SchedulingRequest
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.views import Utilization
from backbone.waiting import end_tasks, set_within
from backbone.wire import Envelope, Message

CALM_EACH_S = 0.002  # chosen: with 100 ARCs five schedules a second, as fast as people can read
TOLERANCE_S = 0.05  # SCHEDULING.md, section 5: reaction and timer tolerance of real processes


class RcManager(Component[RcManagerParameters]):
    """Grants whole sets of RCs by priority and in turns, and explains its decisions."""

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
        self._wake = asyncio.Event()
        self._wake_at_s: float | None = None
        self._log = DecisionLog(bus, clock, self.manager, self.story.note, self._trace_stopped)
        self.shares = self._log.shares
        failures = Failures(clock, self.story.note)
        self._context_switch = ContextSwitch(bus, clock, self.story.note, failures, self._may_leave)
        self._recovery = Recovery(bus, clock)
        self._rcs = RcWatch(self, failures, self._context_switch, self._recovery)
        self._switches = ArcSwitches(self, failures, self._context_switch, self._rcs, given.grace_s)
        self._arcs = ArcWatch(self, failures, self._switches, self._recovery)
        self._hardware = Hardware(self, self._recovery, self._rcs)
        self._resources = self._hardware.resources
        self._changed_tree = ChangedTree(self)
        self._found = Found({}, {})
        self._lines_published = 0

    async def connect(self) -> None:
        """Read the hardware and, after a restart, its holders; then watch the nameserver for changes."""
        self._log.begin(self.parameters.trace)
        await self._hardware.learn()
        self._found = await self._rcs.cleared(await self._recovery.find(self._resources))

    async def serve(self) -> None:
        """Take over the findings; then wake when a decision is due, renew leases, publish changes."""
        self._take_over(self._found)
        self.bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard_from_nameserver)
        self.bus.subscribe(f"{Subsystem.RESOURCE_POOL}/*", Conversation.BEAT, Beat, self._arcs.heard_beat)
        self._hardware.follow()
        self.bus.watch_link(self._link_changed)
        async with asyncio.TaskGroup() as loops:
            loops.create_task(self._wake_when_due())
            loops.create_task(self._renew())
            loops.create_task(self._hardware.keep_comparing())

    def parameters_changed(self) -> None:
        """Refuse, because the places of waiting ARCs depend on the present rules.

        Raises:
            FixedRules: Always.
        """
        raise FixedRules(f"{self.name} keeps the rules it began with")

    async def drain(self) -> None:
        """End all switches; the remaining holds end by lease, or the next RC manager takes them over."""
        await end_tasks(*self._switches.tasks, *self._rcs.starts)
        await self._log.end()

    def statistics(self) -> dict[str, float]:
        """Count decisions and switches; switch times are from revoke to grant, settling not counted."""
        return {**self._switches.statistics(), "held": float(len(self.manager.leases()))}

    def absences(self) -> list[Absence]:
        """Return RCs that cannot be used, and ARCs that want time and cannot run."""
        return [*self._rcs.absences(), *self._arcs.absences(self.answers)]

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ARCs, consoles and tools."""
        self._arcs.require_sender(asked)
        self._arcs.keep_change(asked.body)
        match asked.body:
            case SchedulingRequest() as request:
                return await self.request(request)
            case Withdraw(arc=arc, reason=reason):
                self._arcs.forget(arc)
                self.happened(Departed(arc, reason or "self"))
            case SetIdle(arc=arc, idle=idle):
                self.happened(Idled(arc) if idle else Wanted(arc))
            case ChangeRuntime(arc=arc, minimum_runtime_s=least, maximum_runtime_s=most):
                self.happened(RuntimeChanged(arc, least, most))
            case Extend(arc=arc, until_s=until_s):
                self.happened(Extended(arc, until_s))
            case SetPriority(node=node, priority=priority):
                self.happened(PriorityChanged(node, priority))
                self._changed_tree.keep()
            case MoveNode(node=node, parent=parent):
                self.manager.require_movable(node, parent)
                self.happened(NodeMoved(node, parent))
                self._changed_tree.keep()
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

    async def request(self, request: SchedulingRequest) -> Scheduled:
        """Choose RCs for the request, and admit it, unless its ARC withdraws or ends meanwhile: then it is idle.

        Raises:
            Refusal: The request cannot be scheduled.
        """
        with self._arcs.choosing(request) as choosing:
            rcs = await self._hardware.choose(request)
            await self._rcs.have_running(rcs)
            if choosing.request is None:
                return Scheduled([*rcs], RequestState.IDLE, 0, [], -1.0)
            self._admit(choosing.request, rcs)
        return self.answers.scheduled(request.arc, self.clock.now_s())

    def is_choosing(self) -> bool:
        """Return whether RCs were chosen for a request that the schedule manager does not have yet."""
        return self._arcs.is_choosing()

    def admit_again(self, current: CurrentRequest) -> bool:
        """Admit a request with the RCs chosen for it before, unless one is gone or they are no alternative."""
        if is_right := has_its_rcs(current, self._resources):
            self._admit(current.request, tuple(current.rcs))
        return is_right

    def _admit(self, request: SchedulingRequest, rcs: tuple[str, ...], *, others_follow: bool = False) -> None:
        self._arcs.remember(request.arc)
        self.happened(Requested(request, rcs, others_follow))

    def happened(self, event: Event, at_s: float | None = None) -> None:
        """Let the schedule manager decide on the event, at ``at_s`` or now, and begin to carry out its instructions."""
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
            case ConnectArc():
                self._switches.connect(instruction)
            case RevokeArc():
                self._switches.revoke(instruction)
            case RenewLeases():
                self._publish_leases()
            case _:
                assert_never(instruction)

    def _trace_stopped(self) -> None:
        """Inform people; the mission continues without a trace."""
        self.publish_event(self.name, self._log.why_no_trace, LogLevel.WARNING)
        self.changed()

    def _may_leave(self, rc: str, arc: str) -> bool:
        """Return whether only this ARC would lose the RC if the RC counted as down."""
        return rc not in self._rcs.up or all(lease.rc != rc or lease.arc == arc for lease in self.manager.leases())

    def _take_over(self, found: Found) -> None:
        """Pass the hardware, the ARCs that hold it and those that wait to the schedule manager."""
        adopted = found.adopted(self._resources, self.clock.now_s())
        began_s = min((at_s for at_s, _ in adopted), default=self.clock.now_s())
        self._rcs.up.update(found.rcs)
        if self.parameters.tree != KeptTree():
            self.happened(self.parameters.tree, began_s)
        for resource in self._resources.values():
            self.shares.know(resource.name, began_s)
            self.happened(rc_known(resource, found.rcs.get(resource.name)), began_s)
        for at_s, event in adopted:
            self._arcs.remember(event.request.arc)
            self.happened(event, at_s)
        for state in found.rcs.values():
            self.happened(CapacityChanged(state.name, state.capacity))
        for _, event in adopted:
            arc = event.request.arc
            if (until_s := found.arcs[arc].extended_until_s) > self.clock.now_s():
                self.happened(Extended(arc, until_s))
            if event.request.idle:  # it sent that while no RC manager answered
                self.happened(Idled(arc))
        waiting = [current for current in found.waiting() if has_its_rcs(current, self._resources)]
        for number, current in enumerate(waiting, 1):  # an adopted slice that is over ends behind all of them
            self._admit(current.request, tuple(current.rcs), others_follow=number < len(waiting))
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
        """Correct the state of an RC by its own report, because an earlier report, or a renewal, may have been lost."""
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
            self.story.note(rc, "has lost holds that it was given")
            self.happened(RcCameBack(rc, state.last_epoch))

    def _heard_of_packets(self, state: RcState) -> None:
        """Pass packets that take longer than declared to the schedule manager."""
        if state.measured:
            self.happened(PacketsMeasured(state.name, state.measured))

    def _leases(self) -> list[Lease]:
        """Return the leases to renew: all holds, except of ARCs whose failed connections are being undone."""
        return [lease for lease in self.manager.leases() if not self._context_switch.gives_back(lease.arc)]

    def _disappeared(self, name: str) -> None:
        if self._rcs.forget(name):
            self.happened(RcWentDown(name))
        elif self._arcs.forget(name):
            self.happened(Departed(name, "dead"))

    def _link_changed(self, up: bool) -> None:
        if up:
            self.start_task(self._compare_with_nameserver(), "compare")

    async def _compare_with_nameserver(self) -> None:
        """Apply the changes that happened while this process had no link."""
        await self._hardware.compare()
        names = await self._recovery.present()
        for name in [*sorted(self._rcs.up), *self._arcs.known]:
            if name not in names:
                self._disappeared(name)
        for rc in sorted(names & set(self._resources)):
            await self._rcs.meet(rc)

    async def _wake_when_due(self) -> None:
        while True:
            self._wake.clear()
            at_s = self._wake_at_s
            wait_s = None if at_s is None else max(0.0, at_s - self.clock.now_s()) / self.clock.rate
            if not await set_within(self._wake, wait_s):
                self._wake_at_s = None
                self.happened(Woken())

    async def _renew(self) -> None:
        """Renew the leases of ARCs with fresh beats; end the holds of ARCs that hang."""
        rate = self.clock.rate
        while True:
            self._arcs.end_silent()
            self._publish_leases()
            self._hardware.let_go()
            self.changed()
            await self.clock.sleep_s(RENEW_EVERY_S * rate)

    def _publish_leases(self) -> None:
        leases = Leases(self._leases(), LEASE_S * self.clock.rate, self._rcs.missing())
        self.bus.publish(self.address, Conversation.LEASES, leases)

    def calm_s(self) -> float:
        """Return the pause between published schedules: it grows with the number of ARCs; no switch waits for it."""
        return max(CALM_S, CALM_EACH_S * self._lines_published)

    def publish_news(self) -> None:
        """Publish the schedule, if a component may hear it, and, if it has changed, the number of ARCs that run."""
        arcs, no_trace = self.manager.master_schedule.state.arcs, self._log.why_no_trace
        self._lines_published = len(arcs)
        running = sum(1 for arc in arcs.values() if arc.state is RequestState.RUNNING)
        self.feedback = f"{running} of {len(arcs)} ARCs run{f'; {no_trace}' if no_trace else ''}"
        super().publish_news()
        if not self.bus.is_unheard(Conversation.SCHEDULE):
            self.bus.publish(self.address, Conversation.SCHEDULE, self.answers.schedule(self.clock.now_s()))


def _has_lines(trace: Path) -> bool:
    return trace.is_file() and trace.stat().st_size > 0
