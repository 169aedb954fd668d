"""Schedule manager: carries the master schedule out, one context switch after the other.

Events go in, instructions come out. The caller owns the clock and the bus: it reports events with their times, carries
the instructions out, and reports their outcomes. A decision has three steps: *apply* the event, and what is due by now,
to the state; *plan* the next turn; *switch* to it. The last two repeat until no ARC's time has come.

Source: RAM 2002, "The RC Scheduler", last paragraph.
"""

from __future__ import annotations

from typing import assert_never

from backbone.scheduling.alternatives import choose
from backbone.scheduling.arc_events import ArcEvents
from backbone.scheduling.closing import Closing
from backbone.scheduling.entries import CONNECTED, OpenDecision
from backbone.scheduling.events import (
    Adopted,
    CapacityChanged,
    Departed,
    Event,
    Extended,
    Freed,
    Idled,
    Instruction,
    KeptTree,
    NodeMoved,
    Opened,
    OpenFailed,
    PacketsMeasured,
    PriorityChanged,
    RcCameBack,
    RcKnown,
    RcRemoved,
    RcWentDown,
    Record,
    Requested,
    RuntimeChanged,
    Wanted,
    Woken,
)
from backbone.scheduling.invariants import broken
from backbone.scheduling.master_schedule import EXACT_UP_TO, MasterSchedule
from backbone.scheduling.own_planner import PlannerType
from backbone.scheduling.priority_events import PriorityEvents
from backbone.scheduling.priority_tree import PriorityTree
from backbone.scheduling.rc_events import RcEvents
from backbone.scheduling.requests import Lease, NotMovable, SchedulingRequest
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.slice_ends import SliceExpiry
from backbone.scheduling.state import ScheduleState
from backbone.scheduling.switch import Switching
from backbone.scheduling.trace_writer import TraceWriter
from backbone.scheduling.transitions import Transitions


class ScheduleManager:
    """Decides on the present and next holders of every RC.

    Attributes:
        rules: Its rules.
        master_schedule: The plans and the state; only this manager changes them.
        tree: The behavior tree with its priorities.
    """

    def __init__(
        self,
        rules: SchedulingRules,
        *,
        tolerance_s: float,
        exact_up_to: int = EXACT_UP_TO,
        mission: str,
        mission_priority: int,
        goes_on: bool = False,
        planner: PlannerType | None = None,
    ) -> None:
        """Begin with no RCs and no ARCs.

        Args:
            rules: Rules of the decisions.
            tolerance_s: Reaction and timer tolerance of this run.
            exact_up_to: Groups of at most this size are planned whole.
            mission: Name of the mission's own node, root of the behavior tree.
            goes_on: True if the trace continues the trace of an earlier RC manager.
            planner: Plans all groups; None: the planners of this package plan them.
        """
        self.rules = rules
        self._beginning = (tolerance_s, exact_up_to, mission, mission_priority, goes_on)
        self._state = ScheduleState(
            discipline=rules.discipline, admission=rules.admission, tolerance_s=tolerance_s, exact_up_to=exact_up_to
        )
        self.master_schedule = MasterSchedule(
            self._state,
            strict=rules.policy == "strict",
            tolerance_s=tolerance_s,
            exact_up_to=exact_up_to,
            planner=planner,
        )
        self.tree = PriorityTree(mission, mission_priority)
        decision, schedule = OpenDecision(), self.master_schedule
        self._decision = decision
        self._ends = ends = SliceExpiry(self._state)
        self._trace = TraceWriter(decision, goes_on=goes_on)
        self._transitions = Transitions(decision, schedule, ends, self._trace, rules, tolerance_s=tolerance_s)
        self._priorities = PriorityEvents(self._transitions, self.tree)
        self._arcs = ArcEvents(self._transitions, self.tree, self._priorities)
        self._rcs = RcEvents(self._transitions)
        self._switching = Switching(self._transitions)
        self._closing = Closing(self._transitions, self._arcs, self._priorities)

    def begun_anew(self, rules: SchedulingRules, planner: PlannerType | None = None) -> ScheduleManager:
        """Return another manager with the same begin, but with these rules."""
        tolerance_s, exact_up_to, mission, mission_priority, goes_on = self._beginning
        return ScheduleManager(
            rules,
            tolerance_s=tolerance_s,
            exact_up_to=exact_up_to,
            mission=mission,
            mission_priority=mission_priority,
            goes_on=goes_on,
            planner=planner,
        )

    @property
    def decided_s(self) -> float:
        """Mission time of the last decision."""
        return self._decision.now_s

    @property
    def wake_s(self) -> float | None:
        """Mission time at which the manager must be woken; None: no time."""
        return self._closing.wake_s

    # Events in, instructions out: apply, plan, switch.

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Apply an event and decide.

        An event about an unknown ARC or RC, or an outdated event, changes nothing.

        Returns:
            Instructions, to be carried out in this order.
        """
        decision = self._decision
        decision.now_s, decision.instructions, decision.ended = max(now_s, decision.now_s), [], []
        self._apply(event)
        decision.is_put_off = isinstance(event, Requested) and event.others_follow
        if decision.is_put_off:
            return decision.instructions
        if self._arcs.retrying:
            self._arcs.retry()
        self._ends.check(decision.now_s)
        if self.rules.aging_s:
            self._priorities.age()
        if self._arcs.understating:
            self._arcs.ask_anew_where_late()
        while (turn := self.master_schedule.due(decision.now_s)) or self._closing.renew_slices():
            if turn is None:
                continue  # slices that began anew changed the plan
            if turn.in_the_way:
                self._switching.make_way(turn)
            elif not (self._arcs.understating and self._arcs.ask_anew_beside(turn.arc)):
                self._switching.connect(turn.arc)
            if self.rules.aging_s:
                self._priorities.age()
        self._closing.close(rang=isinstance(event, Woken))
        return decision.instructions

    def _apply(self, event: Event) -> None:
        match event:
            case RcKnown():
                self._rcs.known(event)
            case RcWentDown(rc=rc, fault=fault):
                self._rcs.went_down(rc, fault=fault)
            case RcRemoved(rc=rc):
                if not self._arcs.ask_for(rc):
                    self._rcs.removed(rc)
            case RcCameBack(rc=rc, last_epoch=last_epoch):
                self._rcs.came_back(rc, last_epoch)
            case CapacityChanged(rc=rc, capacity=capacity):
                self._rcs.capacity_changed(rc, capacity)
            case PacketsMeasured(rc=rc, packets=packets):
                self._arcs.packets_measured(rc, packets)
            case Requested():
                self._arcs.requested(event)
            case Adopted():
                self._arcs.adopted(event)
            case Wanted(arc=arc):
                self._arcs.wanted(arc)
            case Idled(arc=arc):
                self._arcs.idled(arc)
            case Departed(arc=arc, why=why):
                self._arcs.departed(arc, why)
            case RuntimeChanged():
                self._arcs.runtime_changed(event)
            case Extended(arc=arc, until_s=until_s):
                self._arcs.extended(arc, until_s)
            case PriorityChanged(node=node, priority=priority):
                self._priorities.priority_changed(node, priority)
            case NodeMoved(node=node, parent=parent):
                self._priorities.node_moved(node, parent)
            case KeptTree():
                self.tree.restore(event)
            case Opened(arc=arc):
                self._arcs.opened(arc)
            case OpenFailed(arc=arc, rc=rc):
                self._rcs.went_down(rc, lost_by=arc)
                self._arcs.open_failed(arc, rc)
            case Freed(arc=arc):
                self._arcs.freed(arc)
            case Woken():
                pass
            case _:
                assert_never(event)

    # Views.

    def choose(self, request: SchedulingRequest) -> tuple[str, ...]:
        """Return the set of RCs that this request should wait for; nothing changes.

        Raises:
            MissingRuntime: The request has no valid minimum run time.
            UnknownRc: All alternatives name RCs that do not exist.
            CapacityExceeded: It could not run even alone; facts ``demanded``, ``used`` and ``free``.
            SchedulingRefusal: The request has no RC, or a stream with impossible times.
        """
        return choose(self._state, request)

    def require_movable(self, node: str, parent: str) -> None:
        """Return if the node of the behavior tree can be moved below this parent, else raise; nothing changes.

        Raises:
            NotMovable: The node cannot be moved there.
        """
        obstacle = self.tree.obstacle(node, parent)
        if obstacle:
            raise NotMovable(f"{node} cannot be moved below {parent}: {obstacle}", node=node, parent=parent)

    def leases(self) -> list[Lease]:
        """Return all holds that must be renewed: those of ARCs that connect or run."""
        return [
            Lease(rc, arc.name, epoch, ranks.get(rc, -1))
            for arc in self._state.arcs.values()
            if arc.state in CONNECTED
            for ranks in [self._switching.ranks(arc)]
            for rc, epoch in arc.epochs.items()
        ]

    def knows(self, rc: str) -> bool:
        """Return whether requests may name this RC."""
        return rc in self._state.rcs

    def epoch_of(self, rc: str) -> int:
        """Return the largest epoch given for this RC so far; 0 if it is not known."""
        return self._state.rcs[rc].epoch if rc in self._state.rcs else 0

    def opening_lines(self) -> list[Record]:
        """Return the records with which a trace begins."""
        return [self._transitions.opening_line()]

    def check(self) -> None:
        """Return if the invariants of the schedule hold, or its decision waits for further requests, else raise.

        Raises:
            AssertionError: An invariant is broken; with the story of the ARCs concerned.
        """
        if self._decision.is_put_off:
            return
        for invariant, whom in broken(self.master_schedule, self._decision.now_s):
            story = self._trace.story_of({arc.name for arc in whom})
            raise AssertionError("\n".join([f"broken at {self._decision.now_s}: {invariant}", *map(str, story)]))
        for rc in self._state.rcs.values():
            if self._trace.says_up(rc.name) not in (None, rc.up):
                lines = map(str, self._trace.story_of({rc.name}))
                raise AssertionError("\n".join([f"{rc.name} is {'up' if rc.up else 'down'}, not by the trace", *lines]))
