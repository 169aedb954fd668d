"""Table: the RCs, the ARCs, who of them can run together, and who goes before whom.

It keeps what is true now and notes which RCs something happened to; when whose time comes, the
master schedule works out from it.

Rules of this file (numbers as in docs and ``why``):

* 1  All or nothing; one holder of an exclusive RC; every stream of every holder meets its deadline.
* 2  Order: oldest stamp first, but nobody before one that is higher.
* 4  A higher ARC stands in nobody's shadow: lower holders stand in its way only until now.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.scheduling.entries import CONNECTED, INSTANT_S, SOON_S, ArcEntry, RcEntry
from backbone.scheduling.fairness import Discipline, deadline_s, eligible, joining_s
from backbone.scheduling.groups import Group, Groups
from backbone.scheduling.priority import Level, Path, by_precedence, rank
from backbone.scheduling.requests import RcUse, RequestState, SchedulingRequest
from backbone.scheduling.response_time import Analysis, admissible, exceeds, stream

SETS_REMEMBERED = 4096  # chosen: sets of users of one RC; a group of 30 meets some hundred between two arrivals
EXACT_UP_TO = 64  # chosen: such a group is planned in a few milliseconds


class Table:
    """Who is there, and what fits together.

    Attributes:
        rcs: All RCs by name.
        arcs: All ARCs that asked, by name, in the order of their requests.
        strict: No ARC starts while a higher usable one of its group waits.
        discipline: Which of several equals comes first.
        admission: How it is decided what a sharable RC can serve.
    """

    def __init__(
        self, *, tolerance_s: float, strict: bool, discipline: Discipline, admission: Analysis, exact_up_to: int
    ) -> None:
        """Begin empty.

        Args:
            tolerance_s: Reaction and timer tolerance of this run.
            strict: No ARC starts while a higher usable one of its group waits.
            discipline: Which of several equals comes first.
            admission: How it is decided what a sharable RC can serve.
            exact_up_to: Groups of at most this size are planned whole.
        """
        self.rcs: dict[str, RcEntry] = {}
        self.arcs: dict[str, ArcEntry] = {}
        self.strict = strict
        self.discipline: Discipline = discipline
        self.admission: Analysis = admission
        self._tolerance_s = tolerance_s
        self._exact_up_to = exact_up_to
        self._groups: Groups[ArcEntry] = Groups(exact_up_to)
        self._bits: dict[str, int] = {}
        self._levels: dict[Level, Level] = {}
        self._touched: dict[str, None] = {}
        self._busy = 0
        self._now_s = 0.0
        self._ends: list[tuple[float, int, ArcEntry]] = []
        self._serial = itertools.count()
        self._usable: dict[ArcEntry, bool] = {}
        self._admitted: dict[str, dict[frozenset[ArcEntry], bool]] = {}
        self._roomy: dict[str, bool] = {}

    # Who is there, and what changed.

    def add_rc(self, rc: RcEntry) -> None:
        """Take in an RC."""
        self._bits[rc.name] = 1 << len(self._bits)
        self.rcs[rc.name] = rc

    def make_arc(
        self, request: SchedulingRequest, uses: Mapping[str, RcUse], place: tuple[str, ...], path: Path, now_s: float
    ) -> ArcEntry:
        """Take in an ARC, idle, and return its entry; all RCs of ``uses`` are known."""
        rcs = [self.rcs[rc] for rc in uses]
        shares = tuple(rc.name for rc in rcs if rc.sharable and uses[rc.name].streams)
        arc = ArcEntry(
            request=request,
            uses=uses,
            place_in_tree=place,
            path=path,
            level=self._level_of(path),
            minimum_s=request.minimum_runtime_s,
            maximum_s=max(request.minimum_runtime_s, request.maximum_runtime_s),
            settle_s=max((rc.connect_s for rc in rcs), default=0.0),
            release_s=max((rc.disconnect_s for rc in rcs), default=0.0),
            since_s=now_s,
            touches=sum(self._bits[rc.name] for rc in rcs),
            excludes=sum(self._bits[rc.name] for rc in rcs if rc.name not in shares),
            shares=shares,
            streams={rc.name: [stream(usage) for usage in uses[rc.name].streams] for rc in rcs if rc.sharable},
        )
        self.arcs[arc.name] = arc
        return arc

    def move(self, arc: ArcEntry, path: Path) -> None:
        """Give the ARC another place or other numbers; ``priorities_changed`` is to follow."""
        arc.path, arc.level = path, self._level_of(path)

    def _level_of(self, path: Path) -> Level:
        level = (path[:-1], path[-1][1])
        return self._levels.setdefault(level, level)

    def forget_arc(self, arc: ArcEntry) -> None:
        """Take out an ARC that holds nothing."""
        self.enter(arc, RequestState.IDLE, arc.since_s)
        self._usable.pop(arc, None)
        del self.arcs[arc.name]

    def enter(self, arc: ArcEntry, state: RequestState, now_s: float) -> None:
        """Let the ARC come to this state; those it shares RCs with are looked at again."""
        self._now_s = now_s
        was_active, held = arc.active, arc.holds
        if arc.state is RequestState.RUNNING:
            arc.had_s = self._had_s(arc)
        arc.state, arc.since_s = state, now_s
        if arc.active and not was_active:
            self._groups.add(arc, arc.uses)
            self._demand_changed(arc.shares)
            if self.discipline == "time":
                arc.had_s = joining_s(arc.had_s, map(self._had_s, self._rivals(arc)))
        if held != arc.holds:
            for rc in arc.uses:
                if held:
                    del self.rcs[rc].holders[arc]
                else:
                    self.rcs[rc].holders[arc] = None
        self._busy = self._busy | arc.excludes if arc.holds else self._busy & ~(arc.excludes if held else 0)
        if state is RequestState.WAITING:
            for holder in [holder for rc in arc.uses for holder in self.rcs[rc].holders]:
                if holder.state is RequestState.RUNNING:
                    self._await_end(holder)
        self.touch(arc)
        if self.strict and arc in self._groups and len(self._groups.of(arc)) > self._exact_up_to:
            self._touched.update(dict.fromkeys(self.rcs))  # anybody in the group may have been held back by it
        if was_active and not arc.active:
            self._groups.remove(arc)
            self._demand_changed(arc.shares)

    def touch(self, arc: ArcEntry) -> None:
        """Have all who use an RC of the ARC looked at again: something about it changed."""
        self._touched.update(dict.fromkeys(arc.uses))

    def rc_changed(self, rc: str) -> None:
        """Have all who use the RC looked at again: its state or capacity changed."""
        self._service_changed([rc])
        self._touched[rc] = None

    def priorities_changed(self) -> None:
        """Have everybody looked at again."""
        self._service_changed([*self.rcs])
        self._touched.update(dict.fromkeys(self.rcs))

    def end_at(self, arc: ArcEntry, end_s: float) -> None:
        """Let the slice of a running ARC end then."""
        arc.end_s, arc.awaited = end_s, False
        self._busy |= arc.excludes
        if self._somebody_waits_for(arc):
            self._await_end(arc)
        self.touch(arc)

    def _goes_on(self, arc: ArcEntry) -> bool:
        """Say whether the discipline gives an ARC whose slice is over one more at once."""
        if self.discipline == "turns":
            return False
        own = self.seniority(arc)
        waiting = [rival for rival in self._rivals(arc) if rival.state is RequestState.WAITING and self.usable(rival)]
        return bool(waiting) and all(own < self.seniority(rival) for rival in waiting)

    def _somebody_waits_for(self, holder: ArcEntry) -> bool:
        return any(user.state is RequestState.WAITING for rc in holder.uses for user in self._groups.users(rc))

    def _await_end(self, arc: ArcEntry) -> None:
        if not arc.awaited:
            arc.awaited = True
            heapq.heappush(self._ends, (arc.end_s, next(self._serial), arc))

    def next_end_s(self, now_s: float) -> float | None:
        """Return when the next slice ends that somebody waits for; those that have ended are looked at again."""
        self._now_s = now_s
        while self._ends:
            end_s, _, arc = self._ends[0]
            stands = arc.state is RequestState.RUNNING and arc.end_s == end_s
            wanted = stands and self._somebody_waits_for(arc)
            if wanted and end_s > now_s + INSTANT_S:
                return end_s
            heapq.heappop(self._ends)
            if stands:
                arc.awaited = wanted
            if wanted and self._goes_on(arc):
                self.end_at(arc, now_s + arc.minimum_s)
            elif wanted:
                self._busy &= ~arc.excludes
                self.touch(arc)
        return None

    def _demand_changed(self, rcs: Iterable[str]) -> None:
        """Forget whether these sharable RCs have room for all: others ask for them now."""
        for rc in rcs:
            self._roomy.pop(rc, None)
            if len(self._admitted.get(rc, ())) > SETS_REMEMBERED:
                del self._admitted[rc]

    def _service_changed(self, rcs: Iterable[str]) -> None:
        """Forget what these RCs can serve: their capacities or their users' priorities are others now."""
        for rc in rcs:
            self._roomy.pop(rc, None)
            self._admitted.pop(rc, None)
        self._usable.clear()

    # What fits together (rule 1).

    def fits(self, arc: ArcEntry, others: Iterable[ArcEntry]) -> bool:
        """Say whether the ARC can hold all its RCs together with these others."""
        beside = []
        for other in others:
            common = arc.touches & other.touches
            if common:
                if common & (arc.excludes | other.excludes):
                    return False
                beside.append(other)
        return all(self._can_share(rc, [arc, *(other for other in beside if rc in other.uses)]) for rc in arc.shares)

    def clash(self, arc: ArcEntry, other: ArcEntry) -> bool:
        """Say whether the ARC cannot hold all its RCs together with this other one."""
        return bool(arc.touches & other.excludes or arc.excludes & other.touches) or not self.fits(arc, (other,))

    def usable(self, arc: ArcEntry) -> bool:
        """Say whether it could run if nobody else were there: its RCs are up and can serve it."""
        known = self._usable.get(arc)
        if known is None:
            known = self._usable[arc] = all(self.rcs[rc].up for rc in arc.uses) and self.fits(arc, ())
        return known

    def _can_share(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        return self.has_room_for_all(rc) or self._admissible(rc, users)

    def has_room_for_all(self, rc: str) -> bool:
        """Say whether the whole active demand fits at once (rule 15): then no part of it need be looked at."""
        if rc not in self._roomy:
            users = [*self._groups.users(rc)]
            self._roomy[rc] = all(rc in user.shares for user in users) and self._admissible(rc, users)
        return self._roomy[rc]

    def _admissible(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        known = self._admitted.setdefault(rc, {})
        key = frozenset(users)
        if key not in known:
            known[key] = self._serves(rc, users)
        return known[key]

    def _serves(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        capacity = self.rcs[rc].capacity
        streams = [(user, packets, number) for user in users for number, packets in enumerate(user.streams[rc])]
        if exceeds(capacity, [packets for _, packets, _ in streams]):
            return False
        ranked = by_precedence(streams, lambda s: s[0].path, lambda s: (s[1].period_us, s[0].name, s[2]))
        return admissible([packets for _, packets, _ in ranked], capacity, self.admission)

    # Groups and order (rule 2).

    def groups(self) -> list[list[ArcEntry]]:
        """Return the active ARCs, group by group, in the order of their requests."""
        found = [self._groups.of(arc) for arc in self.arcs.values() if arc.active]
        members: dict[Group[ArcEntry], list[ArcEntry]] = {group: [] for group in found}
        for arc in self.arcs.values():
            if arc.active:
                members[self._groups.of(arc)].append(arc)
        return list(members.values())

    def group_of(self, arc: ArcEntry) -> Sequence[ArcEntry]:
        """Return the ARC's group; nobody if it is not active."""
        return [*self._groups.of(arc).arcs] if arc in self._groups else []

    def users(self, rc: str) -> Collection[ArcEntry]:
        """Return the active ARCs that use the RC, in the order in which they became active."""
        return self._groups.users(rc)

    def in_order(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return ARCs of one group in the order of rule 2."""
        ordered = by_precedence(arcs, lambda arc: arc.path, self.seniority)
        for reserved in [arc for arc in ordered if arc.reservation is not None]:
            # A higher one that cannot run at all keeps nobody from what was freed for it.
            if not any(self.usable(other) and other.goes_before(reserved) for other in arcs):
                ordered.remove(reserved)
                ordered.insert(0, reserved)
        return ordered

    def first_in_order(self, arcs: Sequence[ArcEntry]) -> ArcEntry:
        """Return the first of ARCs of one group, at least one, in the order of rule 2."""
        if any(arc.reservation is not None for arc in arcs):
            return self.in_order(arcs)[0]
        by_age = sorted(arcs, key=self.seniority)
        return next(arc for arc in by_age if not any(other.goes_before(arc) for other in arcs))

    def seniority(self, arc: ArcEntry) -> tuple[bool, float, float, int]:
        """Return the key among equals: smaller comes first. Those RCs are being freed for by force come before all."""
        if arc.reservation is not None:
            return (False, -math.inf, -math.inf, arc.reservation)
        if self.discipline == "turns":
            return (False, 0.0, *arc.stamp)
        had_s = self._had_s(arc)
        late = not eligible(had_s, map(self._had_s, self._rivals(arc)), self._tolerance_s)
        if arc.state is RequestState.RUNNING:  # who had as much time, but for what timers miss, comes before who runs
            return (late, deadline_s(had_s, arc.minimum_s) + self._tolerance_s, self._now_s, 0)
        return (late, deadline_s(had_s, arc.minimum_s), *arc.stamp)

    def _had_s(self, arc: ArcEntry) -> float:
        return arc.had_s + (self._now_s - arc.granted_s if arc.state is RequestState.RUNNING else 0.0)

    def _rivals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the equals that cannot run beside the ARC."""
        return [other for other in self.beside(arc) if not rank(other.path, arc.path) and not self.fits(arc, [other])]

    # Who stands in the way (rule 4).

    def stands_until_s(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> float:
        """Return until when the holder stands in the way of the ARC."""
        if holder.state is RequestState.REVOKING:
            return self.free_s(holder, now_s)
        before = 0 if holder.level is arc.level else rank(holder.path, arc.path)
        if before:
            return math.inf if before > 0 else now_s
        if holder.state is RequestState.CONNECTING:  # its slice begins with its grant: it cannot be over yet
            return max(now_s + SOON_S, holder.began_s + holder.length_s)
        return max(now_s, holder.end_s)

    def free_s(self, revoked: ArcEntry, now_s: float) -> float:
        """Return when the RCs of an ARC that is being revoked are expected to be free."""
        return max(now_s + SOON_S, revoked.since_s + revoked.release_s)

    def is_overdue(self, arc: ArcEntry, now_s: float) -> bool:
        """Say whether the RCs of the ARC should have been free by now."""
        return arc.state is RequestState.REVOKING and now_s > arc.since_s + arc.release_s

    def is_held(self, rc: str) -> bool:
        """Say whether somebody holds the RC alone, and its slice is not over."""
        return bool(self._busy & self._bits[rc])

    def is_kept_out(self, arc: ArcEntry) -> bool:
        """Say whether somebody holds an RC of the ARC alone, and its slice is not over."""
        return bool(self._busy & arc.touches)

    def beside(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the others that use an RC of this one."""
        beside = dict.fromkeys(user for rc in arc.uses for user in self._groups.users(rc))
        beside.pop(arc, None)
        return [*beside]

    def holders(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the others that hold an RC of the ARC."""
        holders: dict[ArcEntry, None] = {}
        for rc in arc.uses:
            holders.update(self.rcs[rc].holders)
        holders.pop(arc, None)
        return [*holders]

    def could_start(self, arc: ArcEntry, holders: Iterable[ArcEntry], now_s: float) -> bool:
        """Say whether none of these that it cannot share with holds an RC of it for longer than until now."""
        touches, soon_s = arc.touches, now_s + INSTANT_S
        for holder in holders:
            if (
                holder.touches & touches
                and holder is not arc
                and self.stands_until_s(holder, arc, now_s) > soon_s
                and not self.fits(arc, [holder])
            ):
                return False
        return True

    def in_the_way(
        self, arc: ArcEntry, pending: Sequence[ArcEntry], group: Sequence[ArcEntry], now_s: float
    ) -> list[ArcEntry]:
        """Return the holders that must go so that the ARC can start, no more than necessary, last in order first.

        Those who only wait for RCs that are being freed (``pending``) count as if they had started:
        else the room made here is theirs in a moment and both would displace each other again and again.
        """
        holders = [holder for holder in group if holder.state in CONNECTED and holder.touches & arc.touches]
        movable = [holder for holder in holders if self.stands_until_s(holder, arc, now_s) <= now_s + INSTANT_S]
        staying = [holder for holder in holders if holder not in movable] + [
            p for p in pending if p.touches & arc.touches
        ]
        return self.left_over(arc, staying, movable)

    def left_over(self, arc: ArcEntry, staying: Sequence[ArcEntry], movable: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return those of the movable holders that do not fit beside the ARC, last in order first."""
        kept, left = list(staying), []
        for holder in self.in_order(movable):
            if self.fits(arc, [*kept, holder]):
                kept.append(holder)
            else:
                left.append(holder)
        return left[::-1]

    def overloading(self, rc: str) -> list[ArcEntry]:
        """Return the holders the RC cannot serve beside those before them in order, last first."""
        holders = [h for h in self.arcs.values() if h.state in CONNECTED and rc in h.uses]
        kept: list[ArcEntry] = []
        left: list[ArcEntry] = []
        for holder in self.in_order(holders):
            (kept if self._can_share(rc, [*kept, holder]) else left).append(holder)
        return left[::-1]

    def must_let_higher_go_first(self, arc: ArcEntry) -> bool:
        """Say whether the policy ``strict`` holds the ARC back: a higher usable one of its group waits."""
        return self.strict and any(
            other.state is RequestState.WAITING and other.goes_before(arc) and self.usable(other)
            for other in self._groups.of(arc).arcs
        )

    def planned_whole(self, arc: ArcEntry) -> bool:
        """Say whether the group of an active ARC is planned whole."""
        return len(self._groups.of(arc)) <= self._exact_up_to
