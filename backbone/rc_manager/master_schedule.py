"""Master schedule: all active ARCs, and who may run when.

Nothing here changes who holds what; the schedule manager does. Here is the *plan*: at a time, go
through the waiting ARCs in order and give each the earliest start at which it fits for its whole
settling and minimum run time, without taking anything from those before it.

A decision looks only at groups in which something has happened since the last one. A group of up to
``exact_up_to`` ARCs is planned whole. In a bigger one each RC is reserved for the first in line at it
only: an ARC starts if it is done before those would start, and may overtake who stands further back.

Rules of this file (numbers as in docs and ``why``):

* 1  All or nothing; one holder of an exclusive RC; every stream of every holder meets its deadline.
* 2  Order: oldest stamp first, but nobody before one that is higher.
* 3  Plan: earliest start at which an ARC fits whole; a later start is reserved.
* 4  A higher ARC stands in nobody's shadow: lower holders stand in its way only until now.
* 7  What happens in one group changes no time in another.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import functools
import heapq
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

from backbone.rc_manager.above import Above
from backbone.rc_manager.discipline import Discipline, deadline_s, eligible, joining_s
from backbone.rc_manager.groups import Group, Groups
from backbone.rc_manager.messages import RcUse, RequestState, SchedulingRequest
from backbone.rc_manager.priority import Path, by_precedence, higher, rank
from backbone.rc_manager.radio_admission import Analysis, admissible, stream

INSTANT_S = 1e-9  # chosen: times closer than this are the same; far above the rounding of sums of times
SOON_S = 1e-6  # chosen: an RC that should be free by now is expected at once, but is not free yet

EXACT_UP_TO = 64  # chosen: such a group is planned in a few milliseconds
LOOK_AHEAD = 3  # chosen: how many first ones may wait for each other before the present holders alone tell

HOLDING = frozenset({RequestState.CONNECTING, RequestState.RUNNING, RequestState.REVOKING})
CONNECTED = frozenset({RequestState.CONNECTING, RequestState.RUNNING})


@dataclass(slots=True)
class RcEntry:
    """One RC as the schedule sees it.

    Attributes:
        name: Its name.
        kind: Its type, for people.
        sharable: True if several ARCs may hold it by streams.
        capacity: Part of its time it can give, 0 to 1.
        connect_s: Settling time.
        disconnect_s: Release time.
        up: True if it answers.
        epoch: Largest epoch given so far, at the beginning of settling.
        granted_epoch: Largest epoch of a grant so far.
        failed: True if it went down; False if it only was not started yet.
        holders: ARCs that hold it, settling or not yet free of it, in the order in which they got it.
    """

    name: str
    kind: str
    sharable: bool
    capacity: float
    connect_s: float
    disconnect_s: float
    up: bool
    epoch: int
    granted_epoch: int = 0
    failed: bool = False
    holders: dict[ArcEntry, None] = field(default_factory=dict)


class Afterwards(Enum):
    """What becomes of an ARC once its RCs are free."""

    WAIT = "wait"  # it is in the queue again already
    IDLE = "idle"
    WANT = "want"  # it said idle, and then that it wants time after all
    GONE = "gone"


@dataclass(slots=True, eq=False)
class ArcEntry:
    """One ARC in the master schedule.

    Attributes:
        request: As last sent.
        uses: RC → how it uses it; the alternative that was chosen.
        place_in_tree: Names from the root to its owner.
        path: The same with the present numbers.
        minimum_s: Run time it needs to be served, counted from the grant.
        maximum_s: End of all extensions, counted from the grant.
        settle_s: Longest settling time of its RCs.
        release_s: Longest release time of its RCs.
        touches: The RCs it uses, as a set of bits.
        excludes: Those of them it uses exclusively.
        shares: Names of those it uses by streams.
        stamp: When it became active or was last served, and which of several at that time it was.
        pledge: Set while RCs are being freed for it by force, or where equals reserve nothing from each other: it
            comes before all equals; smaller is earlier.
        state: Where it is.
        since_s: When it came to that state.
        began_s: When its RCs began to settle, while it holds them.
        end_s: End of its slice, while it runs.
        granted_s: When it was granted, while it runs.
        epochs: RC → epoch, while it holds them.
        awaited: Somebody waited for the end of its slice when last looked.
        afterwards: What becomes of it once free, while it is being revoked.
        retry_s: When it asks again after it could not open; None: only when told.
        turns: Grants so far.
        had_s: Time it had, as the discipline ``time`` counts it; without the run that goes on.
        raised: Levels by which it rose because it waited long (aging).
        swapped_out: Why it lost its RCs last; empty: never.
        swapped_out_by: Because of whom.
    """

    request: SchedulingRequest
    uses: Mapping[str, RcUse]
    place_in_tree: tuple[str, ...]
    path: Path
    minimum_s: float
    maximum_s: float
    settle_s: float
    release_s: float
    since_s: float
    touches: int
    excludes: int
    shares: tuple[str, ...]
    stamp: tuple[float, int] = (0.0, 0)
    pledge: int | None = None
    state: RequestState = RequestState.IDLE
    began_s: float = 0.0
    end_s: float = 0.0
    granted_s: float = 0.0
    epochs: dict[str, int] = field(default_factory=dict)
    awaited: bool = False
    afterwards: Afterwards = Afterwards.WAIT
    retry_s: float | None = None
    turns: int = 0
    had_s: float = 0.0
    raised: int = 0
    swapped_out: str = ""
    swapped_out_by: str = ""

    @property
    def name(self) -> str:
        """Name of the ARC."""
        return self.request.arc

    @property
    def active(self) -> bool:
        """It wants time, or still holds RCs."""
        return self.state is not RequestState.IDLE

    @property
    def holds(self) -> bool:
        """RCs are connected to it, settling for it, or not yet free of it."""
        return self.state in HOLDING

    @property
    def queued(self) -> bool:
        """It has a place in the order: it waits, or will wait as soon as its RCs are free."""
        return self.state is RequestState.WAITING or (
            self.state is RequestState.REVOKING and self.afterwards is Afterwards.WAIT
        )

    @property
    def length_s(self) -> float:
        """Time from the beginning of settling to the end of its minimum run time."""
        return self.settle_s + self.minimum_s

    def served(self, now_s: float) -> bool:
        """Say whether it runs and had its whole slice."""
        return self.state is RequestState.RUNNING and now_s >= self.end_s - INSTANT_S


Hold = tuple["ArcEntry", float, float]
"""Who stands in the way as one other ARC sees it, from when (minus infinity: it holds its RCs) and until when."""


class Slot(NamedTuple):
    """The place the plan found for an ARC.

    Attributes:
        arc: The ARC.
        start_s: When its RCs begin to settle; infinite: never, as things are.
        against: Who shares an RC with it and stands in its way for a time.
    """

    arc: ArcEntry
    start_s: float
    against: Sequence[Hold]

    @property
    def end_s(self) -> float:
        """End of its minimum run time."""
        return self.start_s + self.arc.length_s


class Turn(NamedTuple):
    """An ARC whose time has come, and the holders that must go first (none: it connects)."""

    arc: ArcEntry
    in_the_way: Sequence[ArcEntry]


class MasterSchedule:
    """The RCs, the ARCs, and the plan for them.

    Attributes:
        rcs: All RCs by name.
        arcs: All ARCs that asked, by name, in the order of their requests.
    """

    def __init__(
        self,
        *,
        tolerance_s: float,
        strict: bool,
        discipline: Discipline = "turns",
        admission: Analysis = "exact",
        exact_up_to: int = EXACT_UP_TO,
    ) -> None:
        """Begin empty.

        Args:
            tolerance_s: By how much two reservations may overlap. Hand-over takes time: without it an
                ARC never fits a gap that is exactly as long as its slice.
            strict: No ARC starts while a higher usable one of its group waits.
            discipline: Which of several equals comes first.
            admission: How it is decided what a sharable RC can serve.
            exact_up_to: Groups of at most this size are planned whole.
        """
        self.rcs: dict[str, RcEntry] = {}
        self.arcs: dict[str, ArcEntry] = {}
        self._slack_s = tolerance_s
        self.strict = strict
        self.discipline: Discipline = discipline
        self.admission: Analysis = admission
        self._exact_up_to = exact_up_to
        self._groups: Groups[ArcEntry] = Groups(exact_up_to)
        self._bits: dict[str, int] = {}
        self._touched: dict[str, None] = {}
        self._candidates: dict[ArcEntry, None] = {}
        self._reserved: dict[ArcEntry, float] = {}
        self._busy = 0
        self._now_s = 0.0
        self._ends: list[tuple[float, int, ArcEntry]] = []
        self._serial = itertools.count()
        self._firsts: dict[str, ArcEntry | None] = {}
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
            minimum_s=request.minimum_runtime_s,
            maximum_s=max(request.minimum_runtime_s, request.maximum_runtime_s),
            settle_s=max((rc.connect_s for rc in rcs), default=0.0),
            release_s=max((rc.disconnect_s for rc in rcs), default=0.0),
            since_s=now_s,
            touches=sum(self._bits[rc.name] for rc in rcs),
            excludes=sum(self._bits[rc.name] for rc in rcs if rc.name not in shares),
            shares=shares,
        )
        self.arcs[arc.name] = arc
        return arc

    def forget_arc(self, arc: ArcEntry) -> None:
        """Take out an ARC that holds nothing."""
        self.enter(arc, RequestState.IDLE, arc.since_s)
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
        for rc in arc.uses:
            self._firsts.pop(rc, None)

    def rc_changed(self, rc: str) -> None:
        """Have all who use the RC looked at again: its state or capacity changed."""
        self._demand_changed([rc])
        self._touched[rc] = None
        self._firsts.clear()

    def priorities_changed(self) -> None:
        """Have everybody looked at again."""
        self._demand_changed([*self.rcs])
        self._touched.update(dict.fromkeys(self.rcs))
        self._firsts.clear()

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
        own = self._seniority(arc)
        waiting = [rival for rival in self._rivals(arc) if rival.state is RequestState.WAITING and self.usable(rival)]
        return bool(waiting) and all(own < self._seniority(rival) for rival in waiting)

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
        """Forget what was worked out about these sharable RCs: other ARCs, capacities or priorities count now."""
        for rc in rcs:
            self._admitted.pop(rc, None)
            self._roomy.pop(rc, None)

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

    def usable(self, arc: ArcEntry) -> bool:
        """Say whether it could run if nobody else were there: its RCs are up and can serve it."""
        return all(self.rcs[rc].up for rc in arc.uses) and self.fits(arc, ())

    def _can_share(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        return self._has_room_for_all(rc) or self._admissible(rc, users)

    def _has_room_for_all(self, rc: str) -> bool:
        """Say whether the whole active demand fits at once (rule 15): then no part of it need be looked at."""
        if rc not in self._roomy:
            users = [*self._groups.users(rc)]
            self._roomy[rc] = all(rc in user.shares for user in users) and self._admissible(rc, users)
        return self._roomy[rc]

    def _admissible(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        known = self._admitted.setdefault(rc, {})
        key = frozenset(users)
        if key not in known:
            streams = [
                (user, stream(usage), number) for user in users for number, usage in enumerate(user.uses[rc].streams)
            ]
            ranked = by_precedence(streams, lambda s: s[0].path, lambda s: (s[1].period_us, s[0].name, s[2]))
            known[key] = admissible([packets for _, packets, _ in ranked], self.rcs[rc].capacity, self.admission)
        return known[key]

    # Order and plan (rules 2, 3, 4).

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

    def in_order(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return ARCs of one group in the order of rule 2."""
        ordered = by_precedence(arcs, lambda arc: arc.path, self._seniority)
        for pledged in [arc for arc in ordered if arc.pledge is not None]:
            # A higher one that cannot run at all keeps nobody from what was freed for it.
            if not any(self.usable(other) and higher(other.path, pledged.path) for other in arcs):
                ordered.remove(pledged)
                ordered.insert(0, pledged)
        return ordered

    def _seniority(self, arc: ArcEntry) -> tuple[bool, float, float, int]:
        """Return the key among equals: smaller comes first. Those RCs are being freed for by force come before all."""
        if arc.pledge is not None:
            return (False, -math.inf, -math.inf, arc.pledge)
        if self.discipline == "turns":
            return (False, 0.0, *arc.stamp)
        had_s = self._had_s(arc)
        late = not eligible(had_s, map(self._had_s, self._rivals(arc)))
        return (late, deadline_s(had_s, arc.minimum_s), *arc.stamp)

    def _had_s(self, arc: ArcEntry) -> float:
        return arc.had_s + (self._now_s - arc.granted_s if arc.state is RequestState.RUNNING else 0.0)

    def _rivals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the equals that cannot run beside the ARC."""
        return [other for other in self.beside(arc) if not rank(other.path, arc.path) and not self.fits(arc, [other])]

    def plan(
        self, group: Sequence[ArcEntry], now_s: float, *, handed_over: bool = False, slack_s: float | None = None
    ) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order.

        Args:
            group: Active ARCs.
            now_s: From when on.
            handed_over: Plan as if all RCs that are being freed were free already.
            slack_s: By how much an ARC may overlap those before it, but not by more than half its slice;
                None: by the tolerance of this run.
        """
        queued = self.in_order([arc for arc in group if arc.queued])
        return self._plan(queued, group, now_s, handed_over=handed_over, slack_s=slack_s)

    def _plan(
        self,
        queued: Sequence[ArcEntry],
        group: Sequence[ArcEntry],
        now_s: float,
        *,
        handed_over: bool = False,
        slack_s: float | None = None,
        among_equals: bool = True,
    ) -> list[Slot]:
        """Return the place of each of these; see ``plan``.

        Args:
            queued: In order, some of the group.
            group: Active ARCs.
            now_s: From when on.
            handed_over: As for ``plan``.
            slack_s: As for ``plan``.
            among_equals: False: what is reserved from later on binds those below, and equals only if it is pledged.
        """
        forgiven_s = self._slack_s if slack_s is None else slack_s
        holders = [arc for arc in group if arc.state in CONNECTED or (arc.holds and not handed_over)]
        slots: list[Slot] = []
        for arc in queued:
            before = slots if among_equals else [slot for slot in slots if _binds(slot, arc, now_s)]
            against = self._against(arc, holders, before, now_s)
            from_s = self.free_s(arc, now_s) if arc.holds and not handed_over else now_s
            start_s = self._earliest_s(arc, from_s, against, forgiven_s) if self.usable(arc) else math.inf
            slots.append(Slot(arc, start_s, against))
        return slots

    def stands_until_s(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> float:
        """Return until when the holder stands in the way of the ARC."""
        if holder.state is RequestState.REVOKING:
            return self.free_s(holder, now_s)
        before = rank(holder.path, arc.path)
        if before:
            return math.inf if before > 0 else now_s
        if holder.state is RequestState.CONNECTING:  # its slice begins with its grant: it cannot be over yet
            return max(now_s + SOON_S, holder.began_s + holder.length_s)
        return max(now_s, holder.end_s)

    def free_s(self, revoked: ArcEntry, now_s: float) -> float:
        """Return when the RCs of an ARC that is being revoked are expected to be free."""
        return max(now_s + SOON_S, revoked.since_s + revoked.release_s)

    def _against(self, arc: ArcEntry, holders: Iterable[ArcEntry], slots: Iterable[Slot], now_s: float) -> list[Hold]:
        touches, soon_s = arc.touches, now_s + INSTANT_S
        against = []
        for holder in holders:
            if holder.touches & touches and holder is not arc:
                until_s = self.stands_until_s(holder, arc, now_s)
                if until_s > soon_s:
                    against.append((holder, -math.inf, until_s))
        for other, start_s, _ in slots:
            if other.touches & touches and start_s < math.inf:
                against.append((other, start_s, start_s + other.length_s))
        return against

    def _earliest_s(self, arc: ArcEntry, from_s: float, against: Sequence[Hold], forgiven_s: float) -> float:
        """Return the first time from which the ARC fits for its whole length; infinite if there is none.

        A higher ARC stays once it runs: whoever is found to overlap its slot can start only never.
        """
        length_s = arc.length_s - min(forgiven_s, arc.minimum_s / 2)
        start_s = from_s
        for other, begin_s, end_s in sorted(against, key=_begin_s):
            if begin_s >= start_s + length_s - INSTANT_S:
                break
            if not arc.touches & other.touches & (arc.excludes | other.excludes):
                continue
            if end_s == math.inf or (begin_s > -math.inf and higher(other.path, arc.path)):
                return math.inf
            start_s = max(start_s, end_s)
        if start_s == math.inf or all(self._has_room_for_all(rc) for rc in arc.shares):
            return start_s
        return self._earliest_in_a_crowd_s(arc, start_s, length_s, against)

    def _earliest_in_a_crowd_s(self, arc: ArcEntry, from_s: float, length_s: float, against: Sequence[Hold]) -> float:
        """Return the first time from which also the sharable RCs have room for the ARC's streams."""
        lasting = [
            (other, begin_s, math.inf if begin_s > -math.inf and higher(other.path, arc.path) else end_s)
            for other, begin_s, end_s in against
        ]
        times = sorted({from_s, *(end_s for _, _, end_s in lasting if from_s < end_s < math.inf)})
        return next(
            (time_s for time_s in times if self._fits_between(arc, time_s, time_s + length_s, lasting)), math.inf
        )

    def _fits_between(self, arc: ArcEntry, start_s: float, end_s: float, against: Sequence[Hold]) -> bool:
        met = meeting(against, start_s, end_s)
        moments = {start_s, *(begin_s for _, begin_s, _ in met if begin_s > start_s)}
        return all(
            self.fits(
                arc,
                [
                    other
                    for other, begin_s, over_s in met
                    if begin_s <= moment_s + INSTANT_S and over_s > moment_s + INSTANT_S
                ],
            )
            for moment_s in moments
        )

    # Whose time has come (rules 3, 4, 8).

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now, and who must go for it; None if nobody's is.

        Looks where something changed since nobody's time was; asked again after the turn was carried out.
        """
        while self._touched:
            rc = next(iter(self._touched))
            users = self._groups.users(rc)
            group = self._groups.of(next(iter(users))).arcs if users else {}
            if len(group) > self._exact_up_to:
                del self._touched[rc]
                self._candidates.update(dict.fromkeys(self._near(rc)))
                continue
            turn = self._due_in([*group], now_s)
            if turn is not None:
                return turn
            for looked_at in {rc, *(used for arc in group for used in arc.uses)}:
                self._touched.pop(looked_at, None)
        return self._due_beside_others(now_s)

    def forgotten(self, now_s: float) -> ArcEntry | None:
        """Return an ARC whose time is now in a group that is planned whole, wherever that is; for checks."""
        for group in self.groups():
            turn = self._due_in(group, now_s) if len(group) <= self._exact_up_to else None
            if turn is not None:
                return turn.arc
        return None

    def _due_in(self, group: Sequence[ArcEntry], now_s: float) -> Turn | None:
        """Return whose time is now in a group that is planned whole."""
        possible = {arc for arc in group if arc.state is RequestState.WAITING and self._could_start(arc, now_s)}
        if not possible:
            return None
        queued = self.in_order([arc for arc in group if arc.queued])
        while queued[-1] not in possible:
            queued.pop()  # who comes after them changes nothing for them
        while queued:
            turn = self._due_of(queued, group, now_s)
            if turn is None or self.discipline == "turns" or self._in_turn(turn, group, now_s):
                return turn
            queued.remove(turn.arc)
        return None

    def _due_of(self, queued: Sequence[ArcEntry], group: Sequence[ArcEntry], now_s: float) -> Turn | None:
        """Return whose time is now of these, given in order."""

        def starting(**how: Any) -> set[ArcEntry]:
            slots = self._plan(queued, group, now_s, among_equals=self.discipline == "turns", **how)
            return {slot.arc for slot in slots if slot.start_s <= now_s + INSTANT_S}

        now = starting()
        if not now:
            return None
        # A slice is ended only for who fits without forgiveness, however early the hand-overs under way may end:
        # else it might be ended for a gap that closes meanwhile.
        exact = functools.cache(lambda: starting(slack_s=0.0))
        certain = functools.cache(lambda: starting(slack_s=0.0, handed_over=True))
        pending: list[ArcEntry] = []
        for arc in queued:
            if arc.state is not RequestState.WAITING or self._must_let_higher_go_first(arc, group):
                continue
            if arc in now or (arc in exact() and arc in certain()):
                in_the_way = self._in_the_way(arc, pending, group, now_s)
                if in_the_way and arc in certain():
                    return Turn(arc, in_the_way)
                if not in_the_way and arc in now and self.fits(arc, [h for h in group if h.holds]):
                    return Turn(arc, [])
            if arc in certain():
                pending.append(arc)
        return None

    def _in_turn(self, turn: Turn, group: Sequence[ArcEntry], now_s: float) -> bool:
        """Say whether somebody would displace each that must go for this turn also if equals took turns.

        RCs come free as whole sets: who had least time, but would not get all its RCs so, ends no slice.
        """
        order = by_precedence([arc for arc in group if arc.queued], lambda arc: arc.path, lambda arc: arc.stamp)
        slots = self._plan(order, group, now_s, slack_s=0.0, handed_over=True)
        entitled = [slot.arc for slot in slots if slot.start_s <= now_s + INSTANT_S]
        holders = [holder for holder in group if holder.state in CONNECTED]
        return all(
            any(arc.touches & holder.touches and not self.fits(arc, holders) for arc in entitled)
            for holder in turn.in_the_way
        )

    def reserves_by_pledge(self, arc: ArcEntry) -> bool:
        """Say whether only a pledge keeps equals from what is being freed for the ARC."""
        return self.discipline == "time" or len(self._groups.of(arc)) > self._exact_up_to

    def _could_start(self, arc: ArcEntry, now_s: float) -> bool:
        """Say whether, of those it cannot share with, nobody holds an RC of it for longer than until now."""
        return all(
            holder is arc or self.stands_until_s(holder, arc, now_s) <= now_s + INSTANT_S or self.fits(arc, [holder])
            for rc in arc.uses
            for holder in self.rcs[rc].holders
        )

    # Whose time has come in a group that is too big to be planned whole.

    def _due_beside_others(self, now_s: float) -> Turn | None:
        """Return a candidate whose time is now; the others are candidates no more."""
        self._reserved.clear()  # nothing changes while they are looked at
        while self._candidates:
            arc, _ = self._candidates.popitem()
            if not (arc.state is RequestState.WAITING and self._could_start(arc, now_s) and self.usable(arc)):
                continue
            if self._takes_from_others(arc, now_s):
                continue
            if self._must_let_higher_go_first(arc, self._groups.of(arc).arcs):
                continue
            others = self.beside(arc)
            if not self.fits(arc, [h for h in others if h.holds and self.stands_until_s(h, arc, now_s) > now_s]):
                continue  # one by one they would let it in, but not together
            in_the_way = self._in_the_way(arc, [], others, now_s)
            if in_the_way or self.fits(arc, [other for other in others if other.holds]):
                return Turn(arc, in_the_way)
        return None

    def _near(self, rc: str) -> Iterable[ArcEntry]:
        """Return the waiting ARCs for which it matters what happened to this RC.

        That is who uses it, and who shares an RC with those: they may have let them go first.
        """
        users = self._groups.users(rc)
        others = dict.fromkeys(other for arc in users if arc.queued for other in arc.uses)
        near = dict.fromkeys(users)
        for other in others:
            if not self._busy & self._bits[other]:
                near.update(dict.fromkeys(arc for arc in self._groups.users(other) if not arc.touches & self._busy))
        return [arc for arc in near if arc.state is RequestState.WAITING]

    def beside(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the others that use an RC of this one."""
        beside = dict.fromkeys(user for rc in arc.uses for user in self._groups.users(rc))
        beside.pop(arc, None)
        return [*beside]

    def _takes_from_others(self, arc: ArcEntry, now_s: float) -> bool:
        """Say whether, if it started now, it would take time from a higher one or from the first in line at an RC."""
        end_s = now_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

        crowd = [holder for holder in self._crowd(arc) if self.fits(arc, [holder])]

        def from_one(other: ArcEntry) -> bool:
            competes = other is not arc and not self.fits(arc, [other, *crowd]) and self.usable(other)
            return competes and self._reserved_s(other, now_s, (arc,)) < end_s

        firsts = dict.fromkeys(self._first_in_line(rc) for rc in arc.uses)
        if any(from_one(first) for first in firsts if first is not None):
            return True
        return any(from_one(one) for one in self.beside(arc) if one.queued and higher(one.path, arc.path))

    def _crowd(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return those that hold a sharable RC of the ARC."""
        return [*dict.fromkeys(holder for rc in arc.shares for holder in self.rcs[rc].holders if holder is not arc)]

    def _first_in_line(self, rc: str) -> ArcEntry | None:
        """Return the first in order of those queued for the RC; None if nobody is."""
        if rc not in self._firsts:
            queued = [user for user in self._groups.users(rc) if user.queued and self.usable(user)]
            self._firsts[rc] = self.in_order(queued)[0] if queued else None
        return self._firsts[rc]

    def _reserved_s(self, arc: ArcEntry, now_s: float, behind: tuple[ArcEntry, ...]) -> float:
        """Return from when its RCs are reserved for the ARC: when its holders go and others first in line have run.

        Args:
            arc: The ARC.
            now_s: From when on.
            behind: Those that asked for this: they do not wait for themselves, though being equal is not transitive.
        """
        if arc in self._reserved:
            return self._reserved[arc]
        holders = dict.fromkeys(holder for rc in arc.uses for holder in self.rcs[rc].holders)
        ends = [self.stands_until_s(h, arc, now_s) for h in holders if h is not arc and not self.fits(arc, [h])]
        start_s = max([now_s, *ends])
        if len(behind) > LOOK_AHEAD:
            return start_s
        for rc in arc.uses if start_s < math.inf else ():
            first = self._first_in_line(rc)
            if first is None or first is arc or first in behind or self.fits(arc, [first]):
                continue
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < start_s + arc.length_s - INSTANT_S:
                start_s = math.inf if higher(first.path, arc.path) else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s

    def _in_the_way(
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

    def _must_let_higher_go_first(self, arc: ArcEntry, group: Iterable[ArcEntry]) -> bool:
        return self.strict and any(
            other.state is RequestState.WAITING and higher(other.path, arc.path) and self.usable(other)
            for other in group
        )

    # Views: who waits before whom, and when an ARC will start.

    def planned_whole(self, arc: ArcEntry) -> bool:
        """Say whether the group of an active ARC is planned whole."""
        return len(self._groups.of(arc)) <= self._exact_up_to

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs that come before a queued one, in order.

        In a group too big to be planned whole: at one of its RCs; under ``strict`` also higher ones anywhere.
        """
        group = self._groups.of(arc).arcs
        if self.planned_whole(arc):
            order = self.in_order([other for other in group if other.queued])
            return order[: order.index(arc)]
        before: dict[ArcEntry, None] = {}
        for rc in arc.uses:
            order = self.in_order([user for user in self._groups.users(rc) if user.queued])
            before.update(dict.fromkeys(order[: order.index(arc)]))
        if self.strict:
            before.update((other, None) for other in group if other.queued and higher(other.path, arc.path))
        return self.in_order([*before])

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return who is first in line at an RC of the ARC and is not the ARC itself."""
        firsts = dict.fromkeys(self._first_in_line(rc) for rc in arc.uses)
        return [first for first in firsts if first is not None and first is not arc]

    def slot_of(self, arc: ArcEntry, now_s: float) -> Slot | None:
        """Return the place of the ARC in the plan; None if it is not queued."""
        if not arc.queued:
            return None
        group = self.group_of(arc)
        if len(group) > self._exact_up_to:
            return self._estimate([*self.before(arc), arc], now_s)[-1]
        return next(slot for slot in self.plan(group, now_s) if slot.arc is arc)

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of a group, in order; of a big group an estimate."""
        if len(group) <= self._exact_up_to:
            return self.plan(group, now_s)
        return self._estimate(self.in_order([arc for arc in group if arc.queued]), now_s)

    def _estimate(self, order: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return where these will be, given in order, if at each RC one turn after the other is taken.

        What sharers of an RC take of its time is counted by what they send, not stream by stream.
        """
        ends_s: dict[str, float] = {}
        taken_s: dict[str, float] = {}
        exclusive: dict[str, Above] = {rc: Above() for arc in order for rc in arc.uses}
        sharers: dict[str, Above] = {rc: Above() for arc in order for rc in arc.shares}
        slots = []
        for arc in order:
            if not self.usable(arc):
                slots.append(Slot(arc, math.inf, self._standing(arc, now_s)))
                continue
            crowded = [rc for rc in arc.shares if not self._has_room_for_all(rc)]
            alone = [rc for rc in arc.uses if rc not in arc.shares]
            above = [*(exclusive[rc] for rc in arc.uses), *(sharers[rc] for rc in alone if rc in sharers)]
            standing = self._standing(arc, now_s)
            frees_s = [
                end_s + (0.0 if holder.state is RequestState.REVOKING else holder.release_s)
                for holder, _, end_s in standing
            ]
            start_s = max([now_s, *frees_s, *(ends_s.get(rc, now_s) for rc in arc.uses)])
            if crowded or alone:
                start_s = max([start_s, *(now_s + taken_s.get(rc, 0.0) for rc in [*crowded, *alone])])
            if any(one.largest(arc.path) > -math.inf for one in above):
                start_s = math.inf  # once those above it run, they need not end
            slots.append(Slot(arc, start_s, [hold for hold in standing if hold[2] > now_s + INSTANT_S]))
            for rc in arc.uses:
                (sharers if rc in arc.shares else exclusive)[rc].add(arc.path, start_s)
            if start_s < math.inf:
                ends_s.update((rc, start_s + arc.length_s + arc.release_s) for rc in alone)
                for rc in crowded:
                    taken_s[rc] = taken_s.get(rc, 0.0) + arc.length_s * self._share(arc, rc)
        return slots

    def _share(self, arc: ArcEntry, rc: str) -> float:
        """Return the part of what the RC can give that the ARC asks for, 0 to 1."""
        return min(1.0, sum(one.packet_time_s / one.period_s for one in arc.uses[rc].streams) / self.rcs[rc].capacity)

    def _standing(self, arc: ArcEntry, now_s: float) -> list[Hold]:
        """Return the holders that the ARC cannot run beside."""
        return [
            (holder, -math.inf, self.stands_until_s(holder, arc, now_s))
            for holder in dict.fromkeys(holder for rc in arc.uses for holder in self.rcs[rc].holders)
            if holder is not arc and not self.fits(arc, [holder])
        ]


def meeting(holds: Iterable[Hold], start_s: float, end_s: float) -> list[Hold]:
    """Return the holds that overlap this span."""
    return [hold for hold in holds if hold[1] < end_s - INSTANT_S and hold[2] > start_s + INSTANT_S]


def _binds(slot: Slot, arc: ArcEntry, now_s: float) -> bool:
    return slot.start_s <= now_s or slot.arc.pledge is not None or rank(slot.arc.path, arc.path) != 0


def _begin_s(hold: Hold) -> float:
    return hold[1]
