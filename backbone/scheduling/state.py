"""State: the RCs and the ARCs of the schedule, and their relations.

Rules of this file: no decision, no message. Every change records the RCs that it concerns, so that the planners examine
only those, and increases ``version``: results for an earlier version are outdated. The steps of an ARC's life are in
``transitions``; each of them ends with ``enter``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.scheduling.compatibility import Compatibility
from backbone.scheduling.entries import HOLDING, Afterwards, ArcEntry, RcEntry
from backbone.scheduling.events import RcKnown
from backbone.scheduling.fairness import Discipline, EqualTime, Fairness, Turns
from backbone.scheduling.groups import Group, Groups
from backbone.scheduling.priority import Level, Path, rank_of
from backbone.scheduling.requests import RcUse, RequestState, SchedulingRequest
from backbone.scheduling.response_time import Analysis
from backbone.scheduling.streams import stream

MOST_EMPTY_LEVELS = 64  # chosen: they are forgotten long before they cost memory, and seldom


class ScheduleState:
    """The present state.

    Attributes:
        arcs: All ARCs with a request, by name, in the order of their requests.
        groups: The groups of the active ARCs.
        users: RC → the active ARCs that use it, in the order in which they became active.
        compatibility: Which ARCs can hold their RCs together.
        fairness: The order among equals.
        now_s: Time of the last change of an ARC's state.
        version: Grows with every change.
        service_version: Grows with every change of the RCs' service or of priorities.
        rc_versions: RC → a number that grows with every other change that concerns the RC.
        changed: RCs that changes concerned since the planners last examined them, in the order of the changes, with
            the ARCs that began to wait there if nothing else changed, else with none.
        concerned: The RCs that changes concerned since the last examination of the reservations, as a set of bits.
        bits: RC → its bit in sets of RCs.
        held_alone: RCs held exclusively by an ARC whose slice is not over, as a set of bits.
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
        self.users = self.groups.users
        self.roomy: dict[str, bool] = {}
        """Sharable RC → whether its whole active demand fits, if known; see ``Compatibility``."""
        self.compatibility = Compatibility(self.rcs, self.users, admission, self.roomy)
        self._accounts = EqualTime(self.rivals, tolerance_s) if discipline == "time" else None
        self.fairness: Fairness = self._accounts or Turns()
        self.now_s = 0.0
        self.version = 0
        self.service_version = 0
        self.rc_versions: dict[str, int] = {}
        self.changed: dict[str, Sequence[ArcEntry]] = {}
        self.concerned = 0
        self.bits: dict[str, int] = {}
        self._epochs_of_removed: dict[str, int] = {}
        self._levels: dict[tuple[Path, int], Level] = {}
        self.held_alone = 0

    # Changes.

    def concerns(self, rcs: Iterable[str], *, joined: Sequence[ArcEntry] = ()) -> None:
        """Record that a change concerns these RCs.

        Args:
            joined: The idle ARC that began to wait, if that is the change.
        """
        for rc in rcs:
            self.changed[rc] = all_joined(self.changed.get(rc), joined)
            self.concerned |= self.bits.get(rc, 0)
            self.rc_versions[rc] = self.rc_versions.get(rc, 0) + 1
        self.version += 1

    def _service_changed(self, rcs: Collection[str]) -> None:
        """Drop the cached answers about these RCs, and the cached first ARCs in line everywhere.

        The change also concerns the other RCs of the ARCs that use them, because such an ARC keeps its place in line
        there only while it is usable.
        """
        self.service_version += 1
        users = [user for rc in rcs for user in self.users.get(rc, ())]
        self.concerns(dict.fromkeys([*rcs, *[rc for user in users for rc in user.uses]]))
        self.compatibility.service_changed(rcs)

    # RCs.

    def add_rc(self, known: RcKnown) -> RcEntry:
        """Add an RC and return its entry."""
        self.bits.setdefault(known.rc, 1 << len(self.bits))
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
        """Remove an RC that no ARC uses; a later RC of this name continues its epochs."""
        self._epochs_of_removed[rc.name] = rc.epoch
        del self.rcs[rc.name]
        self.changed.pop(rc.name, None)
        self.compatibility.service_changed([rc.name])
        self.service_version += 1
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
        """Count the RC as up, with its next epoch above ``last_epoch``; return whether it was down."""
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

    # Arrival, change and departure of ARCs.

    def add_arc(
        self,
        request: SchedulingRequest,
        uses: Mapping[str, RcUse],
        place: tuple[str, ...],
        path: Path,
        longest_s: float,
        now_s: float,
    ) -> ArcEntry:
        """Add an idle ARC and return its entry.

        Args:
            uses: The RCs chosen for it, all of them known.
            place: Names from the root to its owner.
            path: The same nodes with their numbers.
            longest_s: Longest time of its slices, also for a shorter request.
        """
        level = self._level_of(path)
        rcs = [self.rcs[rc] for rc in uses]
        settle_s = max((rc.connect_s for rc in rcs), default=0.0)
        shares = tuple(rc.name for rc in rcs if rc.sharable and uses[rc.name].streams)
        streams = {rc.name: [stream(usage) for usage in uses[rc.name].streams] for rc in rcs if rc.sharable}
        arc = ArcEntry(
            name=request.arc,
            request=request,
            uses=uses,
            place_in_tree=place,
            path=path,
            level=level,
            minimum_s=request.minimum_runtime_s,
            length_s=settle_s + request.minimum_runtime_s,
            maximum_s=max(request.minimum_runtime_s, request.maximum_runtime_s, longest_s),
            settle_s=settle_s,
            release_s=max((rc.disconnect_s for rc in rcs), default=0.0),
            since_s=now_s,
            touches=sum(self.bits[rc.name] for rc in rcs),
            excludes=sum(self.bits[rc.name] for rc in rcs if rc.name not in shares),
            shares=shares,
            streams=streams,
            measured=streams,
        )
        self.arcs[arc.name] = arc
        return arc

    def request_again(self, arc: ArcEntry, request: SchedulingRequest) -> None:
        """Replace the ARC's request by its newest one."""
        arc.request = request

    def measure(self, arc: ArcEntry, uses: Mapping[str, RcUse]) -> None:
        """Record the ARC's uses with measured packet times; its present request does not change."""
        arc.measured = {rc: [stream(usage) for usage in uses[rc].streams] for rc in arc.streams}
        self.concerns(arc.shares)

    def set_run_times(self, arc: ArcEntry, minimum_s: float, maximum_s: float) -> None:
        """Set the lengths of its slices from the next one on."""
        arc.minimum_s, arc.maximum_s = minimum_s, maximum_s
        arc.length_s = arc.settle_s + minimum_s
        self.concerns(arc.uses)

    def forget(self, arc: ArcEntry) -> None:
        """Remove an ARC, which holds nothing."""
        self.enter(arc, RequestState.IDLE, arc.since_s)
        self.compatibility.forget(arc)
        del self.arcs[arc.name]
        self._forget_levels()

    def set_paths(self, paths: Iterable[tuple[ArcEntry, tuple[str, ...], Path]]) -> None:
        """Set the places of these ARCs in the tree, and their numbers."""
        for arc, place, path in paths:
            arc.place_in_tree, arc.path, arc.level = place, path, self._level_of(path)
        self._forget_levels()
        self._service_changed([*self.rcs])

    def raise_to(self, arc: ArcEntry, levels: int) -> None:
        """Set the levels by which the ARC rose because it waits long."""
        arc.raised = levels

    def enter(self, arc: ArcEntry, state: RequestState, now_s: float) -> None:
        """Let the ARC enter this state."""
        self.now_s = now_s
        was_active, held = arc.active, arc.holds
        if self._accounts is not None and arc.state is RequestState.RUNNING:
            self._accounts.stopped(arc, now_s)
        arc.state, arc.since_s = state, now_s
        arc.active, arc.holds = state is not RequestState.IDLE, state in HOLDING
        arc.queued = state is RequestState.WAITING or (
            state is RequestState.REVOKING and arc.afterwards is Afterwards.WAIT
        )
        self.concerns(arc.uses, joined=() if was_active or not arc.queued else [arc])
        if held != arc.holds:
            for rc in arc.uses:
                if held:
                    del self.rcs[rc].holders[arc]
                else:
                    self.rcs[rc].holders[arc] = None
        if arc.holds:
            self.held_alone |= arc.excludes
        elif held:
            self.held_alone &= ~arc.excludes
        if arc.active and not was_active:
            self.groups.add(arc, arc.uses)
        elif was_active and not arc.active:
            self.groups.remove(arc)
        if arc.active is not was_active:
            for rc in arc.uses:
                self.roomy.pop(rc, None)  # another ARC wants it, to share or alone, or one less
        if self._accounts is not None and arc.active and not was_active:
            self._accounts.joined(arc, now_s)

    def set_afterwards(self, arc: ArcEntry, afterwards: Afterwards) -> None:
        """Set the state that an ARC will have when its revoked RCs are free."""
        arc.afterwards = afterwards
        arc.queued = afterwards is Afterwards.WAIT
        self.concerns(arc.uses)

    def retry_at(self, arc: ArcEntry, time_s: float | None, why: str = "") -> None:
        """Set when an idle ARC is queued again; None: at its own request."""
        arc.retry_s, arc.retry_why = time_s, why

    # Questions.

    def runs_on(self, arc: ArcEntry) -> bool:
        """Return whether the discipline prefers an ARC whose slice is over to the equals that wait for its RCs."""
        if self._accounts is None:
            return False
        waiting = [other for other in self.beside(arc) if other.state is RequestState.WAITING]
        return self._accounts.runs_on(arc, filter(self.compatibility.usable, waiting), self.now_s)

    def beside(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the other ARCs that use an RC of this one."""
        beside = dict.fromkeys(user for rc in arc.uses for user in self.users.get(rc, ()))
        beside.pop(arc, None)
        return [*beside]

    def rivals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the equals that cannot run beside the ARC."""
        fits = self.compatibility.fits
        return [other for other in self.beside(arc) if not rank_of(other, arc) and not fits(arc, [other])]

    def group_of(self, arc: ArcEntry) -> Sequence[ArcEntry]:
        """Return the ARC's group; empty if the ARC is not active."""
        return [*self.groups.of[arc].arcs] if arc in self.groups else []

    def in_groups(self) -> list[list[ArcEntry]]:
        """Return the active ARCs, group by group, in the order of their requests."""
        members: dict[Group[ArcEntry], list[ArcEntry]] = {}
        for arc in self.arcs.values():
            if arc.active:
                members.setdefault(self.groups.of[arc], []).append(arc)
        return list(members.values())

    def _level_of(self, path: Path) -> Level:
        return self._levels.setdefault((path[:-1], path[-1][1]), Level(len(path)))

    def _forget_levels(self) -> None:
        """Forget levels without ARCs, and their ranks, when they are the majority."""
        if len(self._levels) <= MOST_EMPTY_LEVELS + 2 * len(self.arcs):
            return
        present = {arc.level for arc in self.arcs.values()}
        self._levels = {place: level for place, level in self._levels.items() if level in present}
        for level in present:
            level.ranks = {other: known for other, known in level.ranks.items() if other in present}


def all_joined(before: Sequence[ArcEntry] | None, joined: Sequence[ArcEntry]) -> Sequence[ArcEntry]:
    """Return the ARCs that began to wait at an RC in two changes; none if one of them was another change.

    Args:
        before: Those of the first change; None: there was none.
        joined: Those of the second.
    """
    if before is None:
        return joined
    return [*before, *joined] if before and joined else ()
