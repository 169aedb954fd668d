"""State: the RCs, the ARCs and their slices. Every change of a schedule is a named transition of this file.

The life of an ARC:

* ``queue``: IDLE → WAITING, with a new stamp
* ``connect``: WAITING → CONNECTING, with new epochs
* ``grant``: CONNECTING → RUNNING; its slice counts from here; ``begin_slice``: it stays for one more
* ``revoke``: CONNECTING, RUNNING → REVOKING
* ``free``: REVOKING → WAITING or IDLE
* ``rest``: WAITING → IDLE
* ``forget``: IDLE, WAITING, REVOKING → removed

Rules of this file: no decision, no message. Every transition notes the RCs that it concerns, so that the planners
examine those only, and raises ``version``: results for an earlier version are outdated.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.scheduling.compatibility import Compatibility
from backbone.scheduling.entries import INSTANT_S, Afterwards, ArcEntry, RcEntry
from backbone.scheduling.events import RcKnown
from backbone.scheduling.fairness import Discipline, EqualTime, Fairness, Turns
from backbone.scheduling.groups import Group, Groups
from backbone.scheduling.priority import Level, Path, rank
from backbone.scheduling.requests import RcUse, RequestState, SchedulingRequest
from backbone.scheduling.response_time import Analysis, stream


class ScheduleState:
    """The present state.

    Attributes:
        arcs: All ARCs with a request, by name, in the order of their requests.
        groups: The groups of the active ARCs.
        compatibility: Which ARCs can hold their RCs together.
        fairness: The order among equals.
        now_s: Time of the last transition.
        version: Grows with every transition.
    """

    def __init__(self, *, discipline: Discipline, admission: Analysis, tolerance_s: float, exact_up_to: int) -> None:
        """Begin with no RCs and no ARCs.

        Args:
            discipline: The order among equals.
            admission: Test of the demand that a sharable RC can serve.
            tolerance_s: Reaction and timer tolerance of this run.
            exact_up_to: Groups of at most this size are always exactly one group.
        """
        self.rcs: dict[str, RcEntry] = {}
        self.arcs: dict[str, ArcEntry] = {}
        self.groups: Groups[ArcEntry] = Groups(exact_up_to)
        self.compatibility = Compatibility(self.rcs, self.groups.users, admission)
        self.fairness: Fairness = Turns() if discipline == "turns" else EqualTime(self.rivals, tolerance_s)
        self.now_s = 0.0
        self.version = 0
        self._service_version = 0
        self._rc_versions: dict[str, int] = {}
        self._changed: dict[str, None] = {}
        self._bits: dict[str, int] = {}
        self._epochs_of_removed: dict[str, int] = {}
        self._levels: dict[Level, Level] = {}
        self._held_alone = 0
        self._ends: list[tuple[float, int, ArcEntry]] = []
        self._pushed = 0
        self._stamped = 0

    # Changes since the last decision.

    def take_changed(self) -> list[str]:
        """Return the RCs that transitions concerned since the last call, first concerned first."""
        changed = [*self._changed]
        self._changed.clear()
        return changed

    def version_of(self, rc: str) -> int:
        """Return a number that grows with every transition that concerns the RC."""
        return self._rc_versions.get(rc, 0) + self._service_version

    def _concerns(self, rcs: Iterable[str]) -> None:
        for rc in rcs:
            self._changed[rc] = None
            self._rc_versions[rc] = self._rc_versions.get(rc, 0) + 1
        self.version += 1

    def _service_changed(self, rcs: Collection[str]) -> None:
        """Drop the cached answers about these RCs, and with them the first ARCs in line everywhere."""
        self.compatibility.service_changed(rcs)
        self._service_version += 1
        self._concerns(rcs)

    # RCs.

    def add_rc(self, known: RcKnown) -> RcEntry:
        """Take in an RC and return its entry."""
        self._bits.setdefault(known.rc, 1 << len(self._bits))
        entry = RcEntry(
            known.rc,
            known.kind,
            known.sharable,
            known.capacity,
            known.connect_s,
            known.disconnect_s,
            known.up,
            max(known.last_epoch, self._epochs_of_removed.pop(known.rc, 0)),
            is_robot=known.is_robot,
        )
        self.rcs[known.rc] = entry
        return entry

    def remove_rc(self, rc: RcEntry) -> None:
        """Remove an RC that no ARC uses; its name may return for another one, whose epochs go on."""
        self._epochs_of_removed[rc.name] = rc.epoch
        del self.rcs[rc.name]
        self._changed.pop(rc.name, None)
        self.compatibility.service_changed([rc.name])
        self._service_version += 1
        self.version += 1

    def rc_down(self, rc: RcEntry, fault: str | None) -> bool:
        """Count the RC as down, put aside for this fault (None: as before); return whether it was up."""
        if fault is not None:
            rc.fault = fault
        if not rc.up:
            return False
        rc.up, rc.failed = False, True
        self._service_changed([rc.name])
        return True

    def rc_up(self, rc: RcEntry, last_epoch: int) -> bool:
        """Count the RC as up, its next epoch above this one; return whether it was down."""
        rc.epoch = max(rc.epoch, last_epoch)
        if rc.up:
            return False
        rc.up, rc.failed, rc.fault = True, False, ""
        self._service_changed([rc.name])
        return True

    def set_capacity(self, rc: RcEntry, capacity: float) -> None:
        """Set the RC's capacity."""
        rc.capacity = capacity
        self._service_changed([rc.name])

    # ARCs come, change and go.

    def add_arc(
        self,
        request: SchedulingRequest,
        uses: Mapping[str, RcUse],
        place: tuple[str, ...],
        path: Path,
        longest_s: float,
        now_s: float,
    ) -> ArcEntry:
        """Take in an ARC, idle, and return its entry.

        Args:
            request: Its request.
            uses: The RCs chosen for it, all of them known.
            place: Names from the root to its owner.
            path: The same with their numbers.
            longest_s: Longest time of its slices, also for a shorter request.
        """
        rcs = [self.rcs[rc] for rc in uses]
        shares = tuple(rc.name for rc in rcs if rc.sharable and uses[rc.name].streams)
        streams = {rc.name: [stream(usage) for usage in uses[rc.name].streams] for rc in rcs if rc.sharable}
        arc = ArcEntry(
            request=request,
            uses=uses,
            place_in_tree=place,
            path=path,
            level=self._level_of(path),
            minimum_s=request.minimum_runtime_s,
            maximum_s=max(request.minimum_runtime_s, request.maximum_runtime_s, longest_s),
            settle_s=max((rc.connect_s for rc in rcs), default=0.0),
            release_s=max((rc.disconnect_s for rc in rcs), default=0.0),
            since_s=now_s,
            touches=sum(self._bits[rc.name] for rc in rcs),
            excludes=sum(self._bits[rc.name] for rc in rcs if rc.name not in shares),
            shares=shares,
            streams=streams,
            measured=streams,
        )
        self.arcs[arc.name] = arc
        return arc

    def request_again(self, arc: ArcEntry, request: SchedulingRequest) -> None:
        """Keep the ARC's newest request."""
        arc.request = request

    def measure(self, arc: ArcEntry, uses: Mapping[str, RcUse]) -> None:
        """Note the uses with which its packets would be as long as measured; its present request does not change."""
        arc.measured = {rc: [stream(usage) for usage in uses[rc].streams] for rc in arc.streams}
        self._concerns(arc.shares)

    def set_run_times(self, arc: ArcEntry, minimum_s: float, maximum_s: float) -> None:
        """Set the lengths of its slices from the next one on."""
        arc.minimum_s, arc.maximum_s = minimum_s, maximum_s
        self._concerns(arc.uses)

    def forget(self, arc: ArcEntry) -> None:
        """Remove an ARC; it holds nothing afterwards."""
        self._enter(arc, RequestState.IDLE, arc.since_s)
        self.compatibility.forget(arc)
        del self.arcs[arc.name]

    def set_paths(self, paths: Iterable[tuple[ArcEntry, tuple[str, ...], Path]]) -> None:
        """Set these places of ARCs in the tree, with these numbers."""
        for arc, place, path in paths:
            arc.place_in_tree, arc.path, arc.level = place, path, self._level_of(path)
        self._service_changed([*self.rcs])

    def raise_to(self, arc: ArcEntry, levels: int) -> None:
        """Set the levels by which the ARC rose because it waits long."""
        arc.raised = levels

    # The life of an ARC.

    def queue(self, arc: ArcEntry, now_s: float) -> None:
        """Queue the ARC behind all present equals."""
        arc.stamp = self._stamp(now_s)
        arc.reservation = arc.retry_s = None
        arc.has_forced = False
        self._enter(arc, RequestState.WAITING, now_s)

    def reserve(self, arc: ArcEntry, *, forced: bool) -> None:
        """Place a waiting ARC before all equals until it is connected; note if others were preempted for it."""
        arc.has_forced |= forced
        if arc.reservation is None:
            arc.reservation = self._next_stamp()
            self._concerns(arc.uses)

    def connect(self, arc: ArcEntry, now_s: float) -> None:
        """Connect its RCs, each under a new epoch; they begin to settle."""
        for rc in arc.uses:
            self.rcs[rc].epoch += 1
        arc.epochs = {rc: self.rcs[rc].epoch for rc in arc.uses}
        arc.reservation = None
        arc.began_s = now_s
        self._enter(arc, RequestState.CONNECTING, now_s)

    def grant(self, arc: ArcEntry, now_s: float, end_s: float) -> dict[str, int]:
        """Begin its slice; return those of its epochs that are the newest grants of their RCs."""
        arc.granted_s = arc.slice_s = now_s
        arc.has_forced = False
        arc.turns += 1
        self._enter(arc, RequestState.RUNNING, now_s)
        self.end_at(arc, end_s)
        newest = {rc: epoch for rc, epoch in arc.epochs.items() if epoch > self.rcs[rc].granted_epoch}
        for rc, epoch in newest.items():
            self.rcs[rc].granted_epoch = epoch
        return newest

    def adopt(self, arc: ArcEntry, epochs: Mapping[str, int], granted_s: float, now_s: float) -> None:
        """Adopt a slice that an earlier RC manager began, for a waiting ARC."""
        arc.epochs = dict(epochs)
        for rc, epoch in epochs.items():
            entry = self.rcs[rc]
            entry.epoch = max(entry.epoch, epoch)
            entry.granted_epoch = max(entry.granted_epoch, epoch)
        arc.turns = 1
        arc.began_s, arc.granted_s, arc.slice_s = now_s, granted_s, granted_s
        self._enter(arc, RequestState.RUNNING, now_s)
        self.end_at(arc, granted_s + arc.minimum_s)

    def begin_slice(self, arc: ArcEntry, now_s: float, end_s: float) -> None:
        """Begin one more slice of a served ARC that stays connected; its next place is behind its equals."""
        arc.stamp = self._stamp(now_s)
        arc.slice_s = now_s
        arc.turns += 1
        self.end_at(arc, end_s)

    def end_at(self, arc: ArcEntry, end_s: float) -> None:
        """Set the end of a running ARC's slice."""
        arc.end_s, arc.look_s, arc.awaited = end_s, end_s, False
        self._held_alone |= arc.excludes
        if self._is_waited_for(arc):
            self._await_end(arc)
        self._concerns(arc.uses)

    def revoke(self, arc: ArcEntry, now_s: float, why: str, by: str, afterwards: Afterwards) -> None:
        """Revoke its RCs; a served ARC has its next place behind its equals."""
        if arc.served(now_s):
            arc.stamp = self._stamp(now_s)
        arc.swapped_out, arc.swapped_out_by = why, by
        arc.afterwards = afterwards
        self._enter(arc, RequestState.REVOKING, now_s)

    def set_afterwards(self, arc: ArcEntry, afterwards: Afterwards) -> None:
        """Set the state of an ARC once its RCs are free."""
        arc.afterwards = afterwards
        self._concerns(arc.uses)

    def free(self, arc: ArcEntry, now_s: float, state: RequestState) -> None:
        """Count its RCs as free: it waits or is idle."""
        arc.epochs = {}
        self._enter(arc, state, now_s)

    def rest(self, arc: ArcEntry, now_s: float) -> None:
        """Idle a waiting ARC."""
        arc.reservation = None
        self._enter(arc, RequestState.IDLE, now_s)

    def retry_at(self, arc: ArcEntry, time_s: float | None, why: str = "") -> None:
        """Set when an idle ARC wants time again; None: at its own request."""
        arc.retry_s, arc.retry_why = time_s, why

    def _enter(self, arc: ArcEntry, state: RequestState, now_s: float) -> None:
        self.now_s = now_s
        was_active, held = arc.active, arc.holds
        if arc.state is RequestState.RUNNING:
            self.fairness.stopped(arc, now_s)
        arc.state, arc.since_s = state, now_s
        if arc.active and not was_active:
            self.groups.add(arc, arc.uses)
            self.compatibility.demand_changed(arc.shares)
            self.fairness.joined(arc, now_s)
        if held != arc.holds:
            for rc in arc.uses:
                if held:
                    del self.rcs[rc].holders[arc]
                else:
                    self.rcs[rc].holders[arc] = None
        self._held_alone = (
            self._held_alone | arc.excludes if arc.holds else self._held_alone & ~(arc.excludes if held else 0)
        )
        if state is RequestState.WAITING:
            for holder in [holder for rc in arc.uses for holder in self.rcs[rc].holders]:
                if holder.state is RequestState.RUNNING:
                    self._await_end(holder)
        self._concerns(arc.uses)
        if was_active and not arc.active:
            self.groups.remove(arc)
            self.compatibility.demand_changed(arc.shares)

    # Ends of slices.

    def end_slices(self, now_s: float) -> float | None:
        """Check the ended slices for whose end an ARC waits; return when the next check is due."""
        self.now_s = now_s
        self.version += 1  # time alone changes plans
        while self._ends:
            look_s, _, arc = self._ends[0]
            stands = arc.state is RequestState.RUNNING and arc.look_s == look_s
            wanted = stands and self._is_waited_for(arc)
            if wanted and look_s > now_s + INSTANT_S:
                return look_s
            heapq.heappop(self._ends)
            if stands:
                arc.awaited = wanted
            if wanted and self.runs_on(arc):
                arc.look_s, arc.awaited = now_s + arc.minimum_s, False
                self._await_end(arc)
            elif wanted:
                self._held_alone &= ~arc.excludes
                self._concerns(arc.uses)
        return None

    def runs_on(self, arc: ArcEntry) -> bool:
        """Return whether the discipline prefers an ARC whose slice is over to the equals that wait for its RCs."""
        waiting = [other for other in self.beside(arc) if other.state is RequestState.WAITING]
        return self.fairness.runs_on(arc, filter(self.compatibility.usable, waiting), self.now_s)

    def _is_waited_for(self, holder: ArcEntry) -> bool:
        return any(user.state is RequestState.WAITING for rc in holder.uses for user in self.groups.users(rc))

    def _await_end(self, arc: ArcEntry) -> None:
        if not arc.awaited:
            arc.awaited = True
            self._pushed += 1
            heapq.heappush(self._ends, (arc.look_s, self._pushed, arc))

    # Questions.

    def users(self, rc: str) -> Collection[ArcEntry]:
        """Return the active ARCs that use the RC, in the order in which they became active."""
        return self.groups.users(rc)

    def beside(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the others that use an RC of this one."""
        beside = dict.fromkeys(user for rc in arc.uses for user in self.groups.users(rc))
        beside.pop(arc, None)
        return [*beside]

    def rivals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the equals that cannot run beside the ARC."""
        fits = self.compatibility.fits
        return [other for other in self.beside(arc) if not rank(other.path, arc.path) and not fits(arc, [other])]

    def holders(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the others that hold an RC of the ARC."""
        holders: dict[ArcEntry, None] = {}
        for rc in arc.uses:
            holders.update(self.rcs[rc].holders)
        holders.pop(arc, None)
        return [*holders]

    def is_held_alone(self, rc: str) -> bool:
        """Return whether an ARC holds the RC alone, and its slice is not over."""
        return bool(self._held_alone & self._bits[rc])

    def is_kept_out(self, arc: ArcEntry) -> bool:
        """Return whether another ARC holds an RC of this one alone, and its slice is not over."""
        return bool(self._held_alone & arc.touches)

    def group_of(self, arc: ArcEntry) -> Sequence[ArcEntry]:
        """Return the ARC's group; none if it is not active."""
        return [*self.groups.of(arc).arcs] if arc in self.groups else []

    def in_groups(self) -> list[list[ArcEntry]]:
        """Return the active ARCs, group by group, in the order of their requests."""
        members: dict[Group[ArcEntry], list[ArcEntry]] = {}
        for arc in self.arcs.values():
            if arc.active:
                members.setdefault(self.groups.of(arc), []).append(arc)
        return list(members.values())

    def _stamp(self, now_s: float) -> tuple[float, int]:
        return (now_s, self._next_stamp())

    def _next_stamp(self) -> int:
        self._stamped += 1
        return self._stamped

    def _level_of(self, path: Path) -> Level:
        level = (path[:-1], path[-1][1])
        return self._levels.setdefault(level, level)
