"""Schedule manager: carries the master schedule out, one context switch after the other.

Events go in, instructions come out. The caller owns the clock and the bus: it reports what happened
and when, does what it is told, and reports the outcome.

The life of an ARC (state → what ends it):

* IDLE → wanted: WAITING, with a new stamp
* WAITING → its planned start is now and all its RCs are free: CONNECTING
* CONNECTING → ``Opened``: RUNNING, the slice counts from here; or ``OpenFailed``
* CONNECTING, RUNNING → somebody entitled needs its RCs, an RC failed, it is idle or gone: REVOKING
* REVOKING → ``Freed``: WAITING, IDLE, or forgotten

Rules of this file (numbers as in ``master_schedule``):

* 4  What was freed by force goes to the one it was freed for: it is reserved, and comes before its equals.
* 5  A slice ends only if someone entitled can use the RCs.
* 6  revoke → free → connect → grant. An ARC connects only when all its RCs are free.
* 11 Who lost an RC, or the owner, is revoked; the rest of the schedule goes on.

Source: RAM 2002, "The RC Scheduler", last paragraph.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import assert_never

import msgspec

from backbone.scheduling import trace
from backbone.scheduling.alternatives import can_be_planned, choose
from backbone.scheduling.entries import CONNECTED, Afterwards, ArcEntry, RcEntry
from backbone.scheduling.events import (
    Adopted,
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
    PriorityChanged,
    RcCameBack,
    RcKnown,
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
from backbone.scheduling.explain.attributes import attributes
from backbone.scheduling.explain.explanation import Explanation
from backbone.scheduling.invariants import broken
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.plan import Turn
from backbone.scheduling.priority import PriorityTree, carried, higher
from backbone.scheduling.requests import (
    Lease,
    NotMovable,
    RcUse,
    RequestState,
    Scheduled,
    SchedulingRequest,
    UnknownRequest,
)
from backbone.scheduling.rules import ROUNDING, SchedulingRules
from backbone.scheduling.table import EXACT_UP_TO
from backbone.scheduling.trace_writer import TraceWriter
from backbone.scheduling.views import Attributes, Schedule, Why

RETRY_S = 1.0  # chosen: an ARC that cannot open its gate is asked again at a pace that leaves its rivals their time
NOT_EXPECTED_S = -1.0


class ScheduleManager:
    """Who holds which RC now and next."""

    def __init__(
        self,
        rules: SchedulingRules,
        *,
        tolerance_s: float,
        exact_up_to: int = EXACT_UP_TO,
        mission: str,
        mission_priority: int,
        goes_on: bool = False,
    ) -> None:
        """Begin with no RCs and no ARCs.

        Args:
            rules: With which rules to decide.
            tolerance_s: Reaction and timer tolerance of this run.
            exact_up_to: Groups of at most this size are planned whole.
            mission: Name of the mission's own node, root of the behavior tree.
            mission_priority: Its number among the consoles.
            goes_on: True if the trace goes on after that of an earlier RC manager.
        """
        self._rules = rules
        self._tolerance_s = tolerance_s
        self._tree = PriorityTree(mission, mission_priority)
        self._exact_up_to, self._relaxed = exact_up_to, False
        self._table = MasterSchedule(
            tolerance_s=tolerance_s,
            strict=rules.policy == "strict",
            discipline=rules.discipline,
            admission=rules.admission,
            exact_up_to=exact_up_to,
        )
        self._explanation = Explanation(self._table, rules)
        self._now_s = 0.0
        self._count = 0
        self._told: list[Instruction] = []
        self._wake_s: float | None = None
        self._replaced_by: dict[str, Requested] = {}
        self._retrying: dict[str, ArcEntry] = {}
        self._trace = TraceWriter(self._tell, goes_on=goes_on)

    # Events in, instructions out.

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Take note of what happened and decide what follows from it.

        An event about an ARC or RC nobody knows, or one that came too late to matter, changes nothing.

        Args:
            event: What happened.
            now_s: Mission time of the decision.

        Returns:
            Instructions in the order in which they must be carried out.
        """
        self._now_s = max(now_s, self._now_s)
        self._told = []
        self._take_note(event)
        self._retry()
        self._table.next_end_s(self._now_s)
        self._age()
        while turn := self._table.due(self._now_s):
            self._give(turn)
            self._age()
        self._tell_when_again()
        self._set_alarm(rang=isinstance(event, Woken))
        return self._told

    def _take_note(self, event: Event) -> None:
        match event:
            case RcKnown():
                self._rc_known(event)
            case RcWentDown(rc=rc, fault=fault):
                self._rc_down(rc, fault=fault)
            case RcCameBack(rc=rc, last_epoch=last_epoch):
                self._rc_up(rc, last_epoch)
            case CapacityChanged(rc=rc, capacity=capacity):
                self._capacity_changed(rc, capacity)
            case Requested():
                self._requested(event)
            case Adopted():
                self._adopted(event)
            case Wanted(arc=arc):
                self._wanted(arc)
            case Idled(arc=arc):
                self._idled(arc)
            case Departed(arc=arc, why=why):
                self._departed(arc, why)
            case RuntimeChanged():
                self._runtime_changed(event.arc, event.minimum_runtime_s, event.maximum_runtime_s)
            case Extended(arc=arc, until_s=until_s):
                self._extended(arc, until_s)
            case PriorityChanged(node=node, priority=priority):
                self._priority_changed(node, priority)
            case NodeMoved(node=node, parent=parent):
                self._node_moved(node, parent)
            case Opened(arc=arc):
                self._opened(arc)
            case OpenFailed(arc=arc, rc=rc):
                self._open_failed(arc, rc)
            case Freed(arc=arc):
                self._freed(arc)
            case Woken():
                pass
            case _:
                assert_never(event)

    # Context switches.

    def _give(self, turn: Turn) -> None:
        """Connect the ARC whose turn it is, or first revoke who is in its way."""
        if not turn.in_the_way:
            self._connect(turn.arc)
            return
        # Those whose slices are over go first: what is freed by force must not look like the reason for it.
        for holder in sorted(turn.in_the_way, key=lambda holder: higher(turn.arc.path, holder.path)):
            overridden = higher(turn.arc.path, holder.path)
            forced = overridden and not holder.served(self._now_s)
            if (forced or self._table.needs_reservation(turn.arc)) and turn.arc.reservation is None:
                turn.arc.reservation = self._next()
                self._table.touch(turn.arc)
            self._revoke(holder, "higher" if overridden else "slice", turn.arc.name)

    def _connect(self, arc: ArcEntry) -> None:
        for rc in arc.uses:
            self._table.rcs[rc].epoch += 1
        arc.epochs = {rc: self._table.rcs[rc].epoch for rc in arc.uses}
        arc.reservation = None
        arc.began_s = self._now_s
        self._enter(arc, RequestState.CONNECTING)
        self._renew_if_ranks_changed(arc)
        self._trace.record(
            trace.connect(self._now_s, arc.name, arc.epochs), "it is next, and all its RCs are free (rule 3)"
        )
        self._tell(ConnectArc(arc.name, dict(arc.epochs), arc.settle_s, self._now_s + arc.length_s, self._ranks(arc)))

    def _renew_if_ranks_changed(self, arc: ArcEntry) -> None:
        """Have the leases renewed if others hold sharable RCs beside this ARC: their places may be others now."""
        if any(len(self._table.rcs[rc].holders) > 1 for rc in arc.shares):
            self._tell(RenewLeases())

    def _ranks(self, arc: ArcEntry) -> dict[str, int]:
        """Return the ARC's place by user priority among the holders of each sharable RC it uses."""

        def place(rc: str) -> int:
            holders = self._table.rcs[rc].holders
            return sum(other.state in CONNECTED and higher(other.path, arc.path) for other in holders)

        return {rc: place(rc) for rc in arc.uses if self._table.rcs[rc].sharable}

    def _revoke(self, arc: ArcEntry, why: str, by: str, afterwards: Afterwards = Afterwards.WAIT) -> None:
        """Take all its RCs from an ARC that is connected."""
        deadline_s = self._rules.grace_s if why == "slice" and not arc.request.stops_at_once else 0.0
        self._swap_out(arc, why, by)
        arc.afterwards = afterwards
        self._tell(RevokeArc(arc.name, dict(arc.epochs), why, by, deadline_s, NOT_EXPECTED_S))

    def _tell_when_again(self) -> None:
        """Complete what is told to those who lose their RCs by when they can expect them back."""
        for place, told in enumerate(self._told):
            if not isinstance(told, RevokeArc):
                continue
            arc = self._table.arcs.get(told.arc)
            if arc is not None and arc.queued:
                start_s = self._table.start_s(arc, self._now_s)
                if start_s < math.inf:
                    self._told[place] = replace(told, expected_s=start_s + arc.settle_s)

    def _swap_out(self, arc: ArcEntry, why: str, by: str) -> None:
        self._trace.record(trace.revoke(self._now_s, arc.name, why, by), _because(why, by))
        if arc.served(self._now_s):
            arc.stamp = (self._now_s, self._next())
        arc.swapped_out, arc.swapped_out_by = why, by
        arc.afterwards = Afterwards.WAIT
        self._enter(arc, RequestState.REVOKING)

    def _opened(self, name: str) -> None:
        arc = self._table.arcs.get(name)
        if arc is None or arc.state is not RequestState.CONNECTING:
            return
        arc.granted_s = self._now_s
        arc.turns += 1
        self._enter(arc, RequestState.RUNNING)
        self._table.end_at(arc, self._rules.slice_end_s(self._now_s, arc.minimum_s))
        newest = {rc: epoch for rc, epoch in arc.epochs.items() if epoch > self._table.rcs[rc].granted_epoch}
        for rc, epoch in newest.items():
            self._table.rcs[rc].granted_epoch = epoch
        self._trace.record(trace.grant(self._now_s, arc.name, newest), "its RCs have settled")
        if self._rules.grid_s:
            self._trace.record(trace.extend(self._now_s, name, arc.end_s), "slices end on a common grid (rule 15)")

    def _open_failed(self, name: str, rc: str) -> None:
        self._rc_down(rc, lost_by=name)
        arc = self._table.arcs.get(name)
        if arc is None or arc.state is not RequestState.CONNECTING:
            return
        if rc in arc.uses:
            self._swap_out(arc, "rc", rc)
        else:
            self._trace.record(
                trace.about("idle", self._now_s, name), f"it could not open its gate; again in {RETRY_S:g} s"
            )
            self._swap_out(arc, "failed", "")
            arc.afterwards = Afterwards.IDLE
            arc.retry_s = self._now_s + RETRY_S
            self._retrying[name] = arc
        self._freed(name)

    def _freed(self, name: str) -> None:
        arc = self._table.arcs.get(name)
        if arc is None or arc.state is not RequestState.REVOKING:
            return
        arc.epochs = {}
        self._trace.record(trace.about("free", self._now_s, name), "its RCs are in their safe states")
        match arc.afterwards:
            case Afterwards.WAIT:
                self._enter(arc, RequestState.WAITING)
            case Afterwards.IDLE:
                self._enter(arc, RequestState.IDLE)
            case Afterwards.WANT:
                self._enter(arc, RequestState.IDLE)
                self._wanted(name)
            case Afterwards.GONE:
                self._forget(arc)

    def _forget(self, arc: ArcEntry) -> None:
        self._retrying.pop(arc.name, None)
        self._table.forget_arc(arc)
        successor = self._replaced_by.pop(arc.name, None)
        if successor is not None:
            self._requested(successor)

    # What ARCs want.

    def _requested(self, event: Requested) -> None:
        request = event.request
        known = self._table.arcs.get(request.arc)
        if known is None:
            self._add(event)
            return
        if known.afterwards is Afterwards.GONE and known.holds:
            self._replaced_by[request.arc] = event  # it asks anew while its last RCs are still being freed
            return
        place_in_tree = self._note_nodes(request)
        if dict(known.uses) != _chosen(request, event.rcs) or known.place_in_tree != place_in_tree:
            self._replaced_by[request.arc] = event
            self._departed(request.arc, "self", replaced=True)
            return
        known.request = request
        self._runtime_changed(request.arc, request.minimum_runtime_s, request.maximum_runtime_s)
        if request.idle:
            self._idled(request.arc)
        else:
            self._wanted(request.arc)

    def _add(self, event: Requested) -> ArcEntry:
        request = event.request
        for rc in event.rcs:
            self._trace.introduce_rc(self._table.rcs[rc], self._now_s)
        place_in_tree = self._note_nodes(request)
        uses, path = _chosen(request, event.rcs), self._tree.path(place_in_tree)
        arc = self._table.make_arc(request, uses, place_in_tree, path, self._now_s)
        arc.maximum_s = max(arc.maximum_s, self._longest_s(arc.minimum_s))
        self._trace.record_request(arc, self._now_s)
        if not request.idle:
            self._queue(arc)
        return arc

    def _longest_s(self, minimum_s: float) -> float:
        """Return the longest slice of this minimum run time that is not extended on request."""
        return minimum_s + self._rules.grid_s

    def _queue(self, arc: ArcEntry) -> None:
        """Let it wait as one who just came."""
        arc.stamp = (self._now_s, self._next())
        arc.reservation = None
        arc.retry_s = None
        self._enter(arc, RequestState.WAITING)
        if not self._relaxed and len(self._table.group_of(arc)) > self._exact_up_to:
            self._relaxed = True
            self._trace.record(self._meta(), "a group is too big to be planned whole")

    def _adopted(self, event: Adopted) -> None:
        """Let an ARC run on that an earlier RC manager granted its RCs.

        The caller says that it happened when its RCs were connected, so the trace shows its slice as it was.
        """
        request, rcs = event.request, tuple(event.epochs)
        if request.arc in self._table.arcs or any(rc not in self._table.rcs for rc in rcs):
            return
        arc = self._add(Requested(msgspec.structs.replace(request, idle=False), rcs))
        holders = [other for other in self._table.arcs.values() if other.holds]
        if self._table.usable(arc) and self._table.fits(arc, holders):
            self._hold_on(arc, event)
        arc.request = request

    def _hold_on(self, arc: ArcEntry, event: Adopted) -> None:
        arc.epochs = dict(event.epochs)
        for rc, epoch in arc.epochs.items():
            entry = self._table.rcs[rc]
            entry.epoch = max(entry.epoch, epoch)
            entry.granted_epoch = max(entry.granted_epoch, epoch)
        why = "it held its RCs when this RC manager started"
        self._trace.record(trace.connect(self._now_s, arc.name, arc.epochs), why)
        self._trace.record(trace.grant(event.granted_s, arc.name, arc.epochs), why)
        arc.turns = 1
        arc.began_s, arc.granted_s = self._now_s, event.granted_s
        self._enter(arc, RequestState.RUNNING)
        self._table.end_at(arc, event.granted_s + arc.minimum_s)

    def _wanted(self, name: str) -> None:
        arc = self._table.arcs.get(name)
        if arc is None:
            return
        self._replacement_idles(name, idle=False)
        if arc.state is RequestState.REVOKING and arc.afterwards is Afterwards.IDLE:
            arc.afterwards = Afterwards.WANT
        elif arc.state is RequestState.IDLE:
            self._trace.record(trace.about("want", self._now_s, name), "it wants time again")
            self._queue(arc)

    def _idled(self, name: str) -> None:
        arc = self._table.arcs.get(name)
        if arc is None:
            return
        self._replacement_idles(name, idle=True)
        arc.retry_s = None
        if arc.state is RequestState.REVOKING:
            if arc.afterwards is Afterwards.WAIT:
                self._trace.record(trace.about("idle", self._now_s, name), "it wants no time now")
            if arc.afterwards is not Afterwards.GONE:
                arc.afterwards = Afterwards.IDLE
                self._table.touch(arc)
        elif arc.state is not RequestState.IDLE:
            self._trace.record(trace.about("idle", self._now_s, name), "it wants no time now")
            if arc.state is RequestState.WAITING:
                arc.reservation = None
                self._enter(arc, RequestState.IDLE)
            else:
                self._revoke(arc, "self", "", Afterwards.IDLE)

    def _replacement_idles(self, name: str, *, idle: bool) -> None:
        """Let the request that waits for the end of the old one of this name know, too."""
        if name in self._replaced_by:
            event = self._replaced_by[name]
            self._replaced_by[name] = Requested(msgspec.structs.replace(event.request, idle=idle), event.rcs)

    def _departed(self, name: str, why: str, *, replaced: bool = False) -> None:
        if not replaced:
            self._replaced_by.pop(name, None)
        arc = self._table.arcs.get(name)
        if arc is None or (arc.holds and arc.afterwards is Afterwards.GONE):
            return
        self._trace.record(trace.about("depart", self._now_s, name), _because(why, ""))
        if not arc.holds:
            self._forget(arc)
        elif arc.state is RequestState.REVOKING:
            arc.afterwards = Afterwards.GONE
            self._table.touch(arc)
        else:
            self._revoke(arc, why, "", Afterwards.GONE)

    def _runtime_changed(self, name: str, minimum_s: float, maximum_s: float) -> None:
        arc = self._table.arcs.get(name)
        maximum_s = max(maximum_s, self._longest_s(minimum_s))
        if arc is None or (arc.minimum_s, arc.maximum_s) == (minimum_s, maximum_s):
            return
        if not can_be_planned(minimum_s, maximum_s):
            return  # no slice can be planned for such times; the old ones hold on
        arc.minimum_s, arc.maximum_s = minimum_s, maximum_s
        self._table.touch(arc)
        self._trace.record(trace.runtime(self._now_s, name, minimum_s, maximum_s), "from the next slice on")

    def _extended(self, name: str, until_s: float) -> None:
        arc = self._table.arcs.get(name)
        if arc is None or arc.state is not RequestState.RUNNING:
            return
        until_s = min(until_s, arc.granted_s + arc.maximum_s)
        if until_s > arc.end_s:
            self._table.end_at(arc, until_s)
            self._trace.record(trace.extend(self._now_s, name, until_s), "it asked to go on (rule 14)")

    def _retry(self) -> None:
        for arc in [*self._retrying.values()]:
            if arc.retry_s is None:
                del self._retrying[arc.name]
            elif arc.state is RequestState.IDLE and arc.retry_s <= self._now_s:
                del self._retrying[arc.name]
                self._wanted(arc.name)

    # Priorities.

    def _note_nodes(self, request: SchedulingRequest) -> tuple[str, ...]:
        names, renumbered = self._tree.place(request.path, console=request.console)
        if renumbered:
            self._renumber()
        self._trace.introduce_nodes(self._tree.path(names), self._now_s)
        return names

    def _priority_changed(self, node: str, priority: int) -> None:
        self._tree.change(node, priority)
        self._priorities_changed()

    def _node_moved(self, node: str, parent: str) -> None:
        if self._tree.obstacle(node, parent):
            return
        old, new = self._tree.move(node, parent)
        self._trace.nodes_moved(old, new)
        for arc in self._table.arcs.values():
            arc.place_in_tree = carried(arc.place_in_tree, old, new)
        self._priorities_changed()

    def _priorities_changed(self) -> None:
        self._renumber()
        for names in self._trace.nodes():
            self._trace.introduce_nodes(self._tree.path(names), self._now_s)
        for rc in self._table.rcs.values():
            for holder in self._table.overloading(rc.name) if rc.sharable else ():
                self._revoke(holder, "order", rc.name)
        self._tell(RenewLeases())

    def _age(self) -> None:
        """Raise who waits long; it keeps its level until it was served or wants no time any more."""
        if not self._rules.aging_s:
            return
        for arc in self._table.arcs.values():
            if arc.state is RequestState.WAITING:
                arc.raised = int((self._now_s - arc.since_s) / self._rules.aging_s + ROUNDING)
            elif arc.served(self._now_s) or not arc.active:
                arc.raised = 0
        if self._tree.age((arc.place_in_tree, arc.raised) for arc in self._table.arcs.values() if arc.raised):
            self._priorities_changed()

    def _next_aging_s(self) -> float | None:
        if not self._rules.aging_s:
            return None
        waiting = [arc for arc in self._table.arcs.values() if arc.state is RequestState.WAITING]
        return min((arc.since_s + (arc.raised + 1) * self._rules.aging_s for arc in waiting), default=None)

    def _renumber(self) -> None:
        for arc in self._table.arcs.values():
            self._table.move(arc, self._tree.path(arc.place_in_tree))
        self._table.priorities_changed()

    # RCs.

    def _rc_known(self, event: RcKnown) -> None:
        known = self._table.rcs.get(event.rc)
        if known is None:
            self._table.add_rc(
                RcEntry(
                    event.rc,
                    event.kind,
                    event.sharable,
                    event.capacity,
                    event.connect_s,
                    event.disconnect_s,
                    event.up,
                    event.last_epoch,
                )
            )
            if event.up:
                self._trace.introduce_rc(self._table.rcs[event.rc], self._now_s)
            return
        if event.up:
            self._rc_up(event.rc, event.last_epoch)
        else:
            self._rc_down(event.rc)
        self._capacity_changed(event.rc, event.capacity)

    def _rc_down(self, name: str, lost_by: str = "", fault: str = "") -> None:
        """Take note that the RC does not answer; its holders lose all their RCs, ``lost_by`` has lost them already."""
        rc = self._table.rcs.get(name)
        if rc is None:
            return
        if not lost_by:
            rc.fault = fault
        if not rc.up:
            return
        rc.up = False
        rc.failed = True
        self._table.rc_changed(name)
        self._trace.record(trace.rc_state(self._now_s, name, up=False), _aside(fault) or "it does not answer")
        for arc in [*self._table.arcs.values()]:
            if arc.state in CONNECTED and name in arc.uses and arc.name != lost_by:
                self._revoke(arc, "rc", name)

    def _rc_up(self, name: str, last_epoch: int) -> None:
        rc = self._table.rcs.get(name)
        if rc is None:
            return
        if rc.up and any(arc.state in CONNECTED and name in arc.uses for arc in self._table.arcs.values()):
            self._rc_down(name)  # it was away for a moment and forgot its holders
        rc.epoch = max(rc.epoch, last_epoch)
        if rc.up:
            return
        rc.up = True
        rc.failed = False
        rc.fault = ""
        self._table.rc_changed(name)
        if self._trace.has_introduced(name):
            self._trace.record(trace.rc_state(self._now_s, name, up=True), "it answers")
        self._trace.introduce_rc(rc, self._now_s)

    def _capacity_changed(self, name: str, capacity: float) -> None:
        rc = self._table.rcs.get(name)
        if rc is None or rc.capacity == capacity or not 0 <= capacity <= 1:
            return
        rc.capacity = capacity
        self._table.rc_changed(name)
        if self._trace.has_introduced(name):
            self._trace.record(trace.rc_capacity(self._now_s, name, capacity))
        for holder in self._table.overloading(name):
            self._revoke(holder, "capacity", name)

    # Views.

    def choose(self, request: SchedulingRequest) -> tuple[str, ...]:
        """Return the set of RCs this request should wait for; nothing changes.

        Raises:
            MissingRuntime: It does not say for how long it must run at least.
            UnknownRc: All alternatives name RCs that do not exist.
            CapacityExceeded: It could not run even alone; facts ``demanded``, ``used`` and ``free``.
            SchedulingRefusal: It asks for nothing, or for streams that make no sense.
        """
        return choose(self._table, request)

    def scheduled(self, arc: str, now_s: float) -> Scheduled:
        """Return where the request of this ARC is.

        Raises:
            UnknownRequest: It has none.
        """
        return self._explanation.scheduled(self._known(arc), max(now_s, self._now_s))

    def schedule(self, now_s: float) -> Schedule:
        """Return who holds what, who waits for whom, and until when."""
        return self._explanation.schedule(max(now_s, self._now_s))

    def why(self, name: str, now_s: float) -> Why:
        """Return why an ARC, an owner (name or address) or an RC is as it is.

        Raises:
            UnknownRequest: There is none of this name.
        """
        return self._explanation.why(name, max(now_s, self._now_s))

    def attributes(self, name: str) -> Attributes:
        """Return what an ARC, an owner (name or address), or all at and below a node ask for.

        Raises:
            UnknownRequest: There is none of this name.
        """
        return attributes(self._table.arcs.values(), name, self._tree.nodes)

    def require_movable(self, node: str, parent: str) -> None:
        """Return if the node of the behavior tree can be moved below this parent; nothing changes.

        Raises:
            NotMovable: It cannot.
        """
        obstacle = self._tree.obstacle(node, parent)
        if obstacle:
            raise NotMovable(f"{node} cannot be moved below {parent}: {obstacle}", node=node, parent=parent)

    def leases(self) -> list[Lease]:
        """Return all holds that must be renewed: those of ARCs that connect or run."""
        return [
            Lease(rc, arc.name, epoch, ranks.get(rc, -1))
            for arc in self._table.arcs.values()
            if arc.state in CONNECTED
            for ranks in [self._ranks(arc)]
            for rc, epoch in arc.epochs.items()
        ]

    def epoch_of(self, rc: str) -> int:
        """Return the largest epoch given for this RC so far; 0 if it is not known."""
        return self._table.rcs[rc].epoch if rc in self._table.rcs else 0

    def opening_lines(self) -> list[Record]:
        """Return the records with which a trace begins."""
        return [Record(self._meta())]

    def _meta(self) -> trace.Line:
        return trace.meta(
            self._now_s,
            policy=self._rules.policy,
            discipline=self._rules.discipline,
            grace_s=self._rules.grace_s,
            tolerance_s=self._tolerance_s,
            relaxed=self._relaxed,
        )

    def check(self) -> None:
        """Make sure that the schedule keeps its promises.

        Raises:
            AssertionError: It does not; with the story of the ARCs concerned.
        """
        for promise, whom in broken(self._table, self._now_s):
            story = self._trace.story_of({arc.name for arc in whom})
            raise AssertionError("\n".join([f"broken at {self._now_s}: {promise}", *map(str, story)]))
        for rc in self._table.rcs.values():
            if self._trace.says_up(rc.name) not in (None, rc.up):
                lines = map(str, self._trace.story_of({rc.name}))
                raise AssertionError("\n".join([f"{rc.name} is {'up' if rc.up else 'down'}, not by the trace", *lines]))

    # Bookkeeping.

    def _known(self, arc: str) -> ArcEntry:
        if arc not in self._table.arcs:
            raise UnknownRequest(f"no request of {arc!r} is known", name=arc)
        return self._table.arcs[arc]

    def _enter(self, arc: ArcEntry, state: RequestState) -> None:
        self._table.enter(arc, state, self._now_s)

    def _next(self) -> int:
        self._count += 1
        return self._count

    def _tell(self, instruction: Instruction) -> None:
        self._told.append(instruction)

    def _set_alarm(self, *, rang: bool) -> None:
        """Ask to be woken when the next decision can be due without an event."""
        retries = [arc.retry_s for arc in self._retrying.values() if arc.retry_s is not None]
        slice_end_s = self._table.next_end_s(self._now_s)
        times_s = [*retries, slice_end_s, self._next_aging_s()]
        wake_s = min((time_s for time_s in times_s if time_s is not None), default=None)
        if rang or wake_s != self._wake_s:
            self._wake_s = wake_s
            self._tell(WakeAt(wake_s))


def _chosen(request: SchedulingRequest, rcs: Sequence[str]) -> dict[str, RcUse]:
    """Return the alternative of these RCs."""
    return next((dict(wish) for wish in request.alternatives if wish.keys() == {*rcs}), {rc: RcUse() for rc in rcs})


_CAUSES: Mapping[str, str] = {
    "slice": "its slice is over and it is the turn of {by} (rules 3 and 5)",
    "higher": "{by} is higher (rule 4)",
    "rc": "{by} does not answer (rule 11)",
    "capacity": "{by} can give less than before (rule 11)",
    "order": "{by} cannot serve all its holders in time in their new order (rule 11)",
    "failed": "it could not open its gate",
    "self": "its owner wants no time any more",
    "owner": "its owner ended",
    "dead": "it died (rule 11)",
    "silent": "it does not give signs of life (rule 11)",
}


def _aside(fault: str) -> str:
    return f"it is put aside: {fault} (rule 11)" if fault else ""


def _because(why: str, by: str) -> str:
    return _CAUSES.get(why, why).format(by=by)
