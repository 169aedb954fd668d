"""ARC events: the effects of ARCs' requests and messages, and of the outcomes of their context switches.

The plan decides the rest of an ARC's life (``schedule_manager``).

Rules of this file (numbers as in docs and ``why``):

* 1  The measured times of packets count. If an ARC declared less, it requests again with the measured time: as soon as
  it holds nothing, or when its RCs could not otherwise serve all connected and connecting ARCs in time.
* 6  revoke → free → connect → grant.
* 11 An ARC that lost its owner is revoked; the rest of the schedule goes on.
* 14 A running ARC may continue up to its maximum run time; an idle one keeps its request.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from backbone.scheduling.damping import Damping
from backbone.scheduling.entries import CONNECTED, Afterwards, ArcEntry
from backbone.scheduling.events import Adopted, Requested, RuntimeChanged
from backbone.scheduling.packet_times import PacketTimes
from backbone.scheduling.preemption import understating
from backbone.scheduling.priority_events import PriorityEvents
from backbone.scheduling.priority_tree import PriorityTree
from backbone.scheduling.requests import MeasuredPackets, RcUse, RequestState, SchedulingRequest
from backbone.scheduling.run_times import can_be_planned
from backbone.scheduling.transitions import Transitions, because

_NO_USE = RcUse()
RETRY_S = 1.0  # chosen: first retry of an ARC that cannot open its gate; each retry may preempt lower ARCs
LONGEST_RETRY_S = 30.0  # chosen: as long as an owner waits after repeated refusals; some whole slices


class ArcEvents:
    """Applies events of ARCs.

    Attributes:
        retrying: ARCs that will want time again at a later time, by name.
        understating: ARCs whose packets take longer than their requests state, by name.
    """

    def __init__(self, transitions: Transitions, tree: PriorityTree, priorities: PriorityEvents) -> None:
        self._decision, self._transitions, self._trace = transitions.decision, transitions, transitions.trace
        self._state, self._table = transitions.schedule.state, transitions.schedule.table
        self._tree = tree
        self._priorities = priorities
        self._grid_s = transitions.rules.grid_s
        self._successors: dict[str, Requested] = {}
        self.retrying: dict[str, ArcEntry] = {}
        self._retries_s: dict[str, float] = {}
        self._damping = Damping()
        self._packet_times = PacketTimes()
        self.understating: dict[str, ArcEntry] = {}

    # Requests of ARCs.

    def requested(self, event: Requested) -> None:
        """Apply a request or a new version of it; a request for other RCs counts after the present ones are free."""
        request = event.request
        if any(rc not in self._state.rcs for rc in event.rcs):
            return  # an RC was removed after it was chosen
        known = self._state.arcs.get(request.arc)
        if known is None:
            self._add(event)
            return
        if known.afterwards is Afterwards.GONE and known.holds:
            self._successors[request.arc] = event  # a new request while its last RCs are still being freed
            return
        place_in_tree = self._place(request)
        self._trace.introduce_nodes(self._tree.path(place_in_tree))
        is_another = known.request.uses_of(known.uses) != request.uses_of(event.rcs)
        if is_another or known.place_in_tree != place_in_tree:
            self._successors[request.arc] = event
            self._depart(request.arc, "self")
            return
        self._state.request_again(known, request)
        self.runtime_changed(RuntimeChanged(request.arc, request.minimum_runtime_s, request.maximum_runtime_s))
        if request.idle:
            self.idled(request.arc)
        else:
            self.wanted(request.arc)

    def adopted(self, event: Adopted) -> None:
        """Adopt an ARC that an earlier RC manager granted its RCs.

        The caller sets the time of the event to the connection of its RCs, so the trace shows the true slice.
        """
        request, rcs = event.request, tuple(event.epochs)
        if request.arc in self._state.arcs or any(rc not in self._state.rcs for rc in rcs):
            return
        arc = self._add(Requested(msgspec.structs.replace(request, idle=False), rcs))
        holders = [other for other in self._state.arcs.values() if other.holds]
        if self._table.usable(arc) and self._table.fits(arc, holders):
            self._transitions.adopt(arc, event)
        self._state.request_again(arc, request)

    def wanted(self, name: str) -> None:
        """Queue an idle ARC: it wants time again."""
        arc = self._state.arcs.get(name)
        if arc is None:
            return
        self._successor_idles(name, idle=False)
        if arc.state is RequestState.REVOKING and arc.afterwards is Afterwards.IDLE:
            self._state.set_afterwards(arc, Afterwards.WANT)
        elif arc.state is RequestState.IDLE:
            self._want(arc)

    def _want(self, arc: ArcEntry) -> None:
        """Queue an idle ARC, later if its owner requested and withdrew too often."""
        wait_s = self._damping.wait_s(arc.request.owner, self._decision.now_s)
        if wait_s:
            self._wait_to_ask(arc, wait_s, "its owner asked and left before the grant, again and again")
        else:
            self._queue(arc)

    def _queue(self, arc: ArcEntry) -> None:
        if arc.understates:
            self._ask_anew(arc)
            return
        self._trace.record("want", "it wants time again", arc=arc.name)
        self._transitions.queue(arc)

    def _wait_to_ask(self, arc: ArcEntry, wait_s: float, why: str) -> None:
        self._state.retry_at(arc, self._decision.now_s + wait_s, why)
        self.retrying[arc.name] = arc

    def _leaves(self, arc: ArcEntry) -> None:
        if arc.has_forced and arc.state in (RequestState.WAITING, RequestState.CONNECTING):
            self._damping.left_in_vain(arc.request.owner, self._decision.now_s)

    def idled(self, name: str) -> None:
        """Revoke an ARC that wants no time now; it keeps its request."""
        arc = self._state.arcs.get(name)
        if arc is None:
            return
        self._successor_idles(name, idle=True)
        self._leaves(arc)
        self._state.retry_at(arc, None)
        if arc.state is RequestState.REVOKING:
            if arc.afterwards is Afterwards.WAIT:
                self._record_idle(name, "it wants no time now")
            if arc.afterwards is not Afterwards.GONE:
                self._state.set_afterwards(arc, Afterwards.IDLE)
        elif arc.state is not RequestState.IDLE:
            self._record_idle(name, "it wants no time now")
            if arc.state is RequestState.WAITING:
                self._transitions.rest(arc)
            else:
                self._transitions.revoke(arc, "self", "", Afterwards.IDLE)

    def departed(self, name: str, why: str) -> None:
        """Remove an ARC that withdrew or died."""
        self._successors.pop(name, None)
        self._packet_times.forget(name)
        self._depart(name, why)

    def _depart(self, name: str, why: str) -> None:
        arc = self._state.arcs.get(name)
        if arc is None or (arc.holds and arc.afterwards is Afterwards.GONE):
            return
        self._leaves(arc)
        self._remove(arc, why)

    def _remove(self, arc: ArcEntry, why: str) -> None:
        self._trace.record("depart", because(why, ""), arc=arc.name)
        if not arc.holds:
            self._forget(arc)
        elif arc.state is RequestState.REVOKING:
            self._state.set_afterwards(arc, Afterwards.GONE)
        else:
            self._transitions.revoke(arc, why, "", Afterwards.GONE)

    def runtime_changed(self, event: RuntimeChanged) -> None:
        """Set other run times from the ARC's next slice on; times that cannot be planned change nothing."""
        arc, minimum_s = self._state.arcs.get(event.arc), event.minimum_runtime_s
        maximum_s = max(event.maximum_runtime_s, self._longest_s(minimum_s))
        if event.arc in self._successors and can_be_planned(minimum_s, maximum_s):
            self._change_successor(event.arc, minimum_runtime_s=minimum_s, maximum_runtime_s=event.maximum_runtime_s)
        if arc is None or (arc.minimum_s, arc.maximum_s) == (minimum_s, maximum_s):
            return
        if not can_be_planned(minimum_s, maximum_s):
            return
        self._state.set_run_times(arc, minimum_s, maximum_s)
        cause = "from the next slice on"
        self._trace.record("min_run", cause, arc=event.arc, min_run=minimum_s, max_run=maximum_s)

    def extended(self, name: str, until_s: float) -> None:
        """Extend the slice of a running ARC, at most until the end of its maximum run time."""
        arc = self._state.arcs.get(name)
        if arc is None or arc.state is not RequestState.RUNNING:
            return
        until_s = min(until_s, arc.slice_s + arc.maximum_s)
        if until_s > arc.end_s:
            self._transitions.extend(arc, until_s)

    # Packets that take longer than declared.

    def packets_measured(self, rc: str, packets: Sequence[MeasuredPackets]) -> None:
        """Count the measured times of packets; an ARC that waits requests again."""
        for measured in packets:
            name, kind = measured.arc, measured.kind
            arc = self._state.arcs.get(name)
            if arc is None or not any(usage.kind == kind for usage in arc.uses.get(rc, _NO_USE).streams):
                continue
            if not self._packet_times.take(rc, name, kind, measured.packet_time_s):
                continue
            counted = self._packet_times.counted(name, arc.uses)
            if counted != arc.uses:
                self._state.measure(arc, counted)
                self.understating[name] = arc
                if arc.state is RequestState.WAITING:
                    self._ask_anew(arc)

    def ask_anew_where_late(self) -> None:
        """Let connected ARCs request again if an RC cannot serve all of them by the measured times."""
        held = dict.fromkeys(rc for arc in self.understating.values() if arc.state in CONNECTED for rc in arc.shares)
        for rc in held:
            for arc in understating(self._table, rc):
                self._ask_anew(arc)

    def ask_anew_beside(self, arc: ArcEntry) -> bool:
        """Let holders request again if the ARC would be late beside them; return whether there are any."""
        asked = dict.fromkeys(holder for rc in arc.shares for holder in understating(self._table, rc, [arc]))
        for holder in asked:
            self._ask_anew(holder)
        return bool(asked)

    def _ask_anew(self, arc: ArcEntry) -> None:
        """Remove the ARC, and apply the same request with the measured times when its RCs are free."""
        request = msgspec.structs.replace(
            arc.request, minimum_runtime_s=arc.minimum_s, maximum_runtime_s=arc.maximum_s, idle=False
        )
        self._successors[arc.name] = Requested(request, tuple(arc.uses))
        self._remove(arc, "packets")

    # Outcomes of context switches.

    def opened(self, name: str) -> None:
        """Begin the slice: the ARC's RCs have settled and its gate is open."""
        arc = self._state.arcs.get(name)
        if arc is not None and arc.state is RequestState.CONNECTING:
            self._retries_s.pop(name, None)
            self._transitions.grant(arc)

    def open_failed(self, name: str, rc: str) -> None:
        """Queue an ARC whose RCs did not all connect (``rc`` counts as down), or idle one whose gate stayed shut.

        The wait before its retry doubles as long as its gate does not open.
        """
        arc = self._state.arcs.get(name)
        if arc is None or arc.state is not RequestState.CONNECTING:
            return
        if rc in arc.uses:
            self._transitions.lose(arc, "rc", rc)
        else:
            wait_s = self._retries_s[name] = min(LONGEST_RETRY_S, 2 * self._retries_s.get(name, RETRY_S / 2))
            self._record_idle(name, f"it could not open its gate; again in {wait_s:g} s")
            self._transitions.lose(arc, "failed", "", Afterwards.IDLE)
            self._wait_to_ask(arc, wait_s, "it could not open its gate")
        self.freed(name)

    def freed(self, name: str) -> None:
        """Count the ARC's RCs as free: all are in their safe states."""
        arc = self._state.arcs.get(name)
        if arc is None or arc.state is not RequestState.REVOKING:
            return
        afterwards = arc.afterwards
        waits = afterwards is Afterwards.WAIT
        self._trace.record("free", "its RCs are in their safe states", arc=name)
        self._transitions.free(arc, RequestState.WAITING if waits else RequestState.IDLE)
        if afterwards is Afterwards.WANT:
            self.wanted(name)
        elif afterwards is Afterwards.GONE:
            self._forget(arc)
        elif waits and arc.understates:
            self._ask_anew(arc)

    # ARCs that could not open their gates.

    def retry(self) -> None:
        """Queue the ARCs whose retry is due."""
        for arc in [*self.retrying.values()]:
            if arc.retry_s is None:
                del self.retrying[arc.name]
            elif arc.state is RequestState.IDLE and arc.retry_s <= self._decision.now_s:
                del self.retrying[arc.name]
                self._queue(arc)

    def next_retry_s(self) -> float | None:
        """Return when the next ARC retries; None if none does."""
        return min((arc.retry_s for arc in self.retrying.values() if arc.retry_s is not None), default=None)

    # Bookkeeping.

    def ask_for(self, rc: str) -> bool:
        """Return whether a request names this RC."""
        coming = any(rc in event.rcs for event in self._successors.values())
        return coming or any(rc in arc.uses for arc in self._state.arcs.values())

    def _add(self, event: Requested) -> ArcEntry:
        request, now_s = event.request, self._decision.now_s
        longest_s = self._longest_s(request.minimum_runtime_s)
        chosen = request.uses_of(event.rcs)
        place_in_tree = self._place(request)
        path = self._tree.path(place_in_tree)
        uses = self._packet_times.counted(request.arc, chosen)
        wait_s = 0.0 if request.idle else self._damping.wait_s(request.owner, now_s)
        arc = self._state.add_arc(request, uses, place_in_tree, path, longest_s, now_s)
        rcs = [self._state.rcs[rc] for rc in event.rcs]
        self._trace.record_request(arc, rcs, idle=request.idle or wait_s > 0)
        if wait_s:
            self._wait_to_ask(arc, wait_s, "its owner asked and left before the grant, again and again")
        elif not request.idle:
            self._transitions.queue(arc)
        return arc

    def _place(self, request: SchedulingRequest) -> tuple[str, ...]:
        """Add the nodes of a request to the tree; return the names from the root to its owner."""
        place_in_tree, renumbered = self._tree.place(request.path, console=request.console)
        if renumbered:
            self._priorities.renumber()
        return place_in_tree

    def _longest_s(self, minimum_s: float) -> float:
        """Return the longest slice with this minimum run time, without extensions on request."""
        return minimum_s + self._grid_s

    def _forget(self, arc: ArcEntry) -> None:
        self.retrying.pop(arc.name, None)
        self._retries_s.pop(arc.name, None)
        self.understating.pop(arc.name, None)
        self._state.forget(arc)
        if arc.request.console:
            present = [other.place_in_tree for other in self._state.arcs.values()]
            self._trace.forget_nodes(self._tree.forget(arc.place_in_tree, present))
        successor = self._successors.pop(arc.name, None)
        if successor is not None:
            self.requested(successor)

    def _successor_idles(self, name: str, *, idle: bool) -> None:
        """Apply an event also to the request that waits for the end of the ARC's old request."""
        if name in self._successors:
            self._change_successor(name, idle=idle)

    def _change_successor(self, name: str, **changes: object) -> None:
        event = self._successors[name]
        self._successors[name] = Requested(msgspec.structs.replace(event.request, **changes), event.rcs)

    def _record_idle(self, name: str, cause: str) -> None:
        self._trace.record("idle", cause, arc=name)
