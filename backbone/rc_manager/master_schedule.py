"""Master schedule: all active ARCs, and who may run when.

Nothing here changes who holds what; the schedule manager does. Here is the *plan*: at a time, go
through the waiting ARCs in order and give each the earliest start at which it fits for its whole
settling and minimum run time, without taking anything from those before it.

Rules of this file (numbers as in docs and ``why``):

* 1  All or nothing; one holder of an exclusive RC; every stream of every holder meets its deadline.
* 2  Order: oldest stamp first, but nobody before one that is higher.
* 3  Plan: earliest start at which an ARC fits whole; a later start is reserved.
* 4  A higher ARC stands in nobody's shadow: lower holders stand in its way only until now.
* 7  What happens in one group changes no time in another.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from backbone.rc_manager.groups import groups
from backbone.rc_manager.messages import RcUse, RequestState, SchedulingRequest
from backbone.rc_manager.priority import Path, by_precedence, higher
from backbone.rc_manager.radio_admission import admissible, stream

INSTANT_S = 1e-9  # chosen: times closer than this are the same; far above the rounding of sums of times
SOON_S = 1e-6  # chosen: an RC that should be free by now is expected at once, but is not free yet

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
        stamp: When it became active or was last served, and which of several at that time it was.
        pledge: Set while RCs are being freed by force for it: it comes before all equals; smaller is earlier.
        state: Where it is.
        since_s: When it came to that state.
        began_s: When its RCs began to settle, while it holds them.
        end_s: End of its slice, while it runs.
        granted_s: When it was granted, while it runs.
        epochs: RC → epoch, while it holds them.
        afterwards: What becomes of it once free, while it is being revoked.
        retry_s: When it asks again after it could not open; None: only when told.
        turns: Grants so far.
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
    stamp: tuple[float, int] = (0.0, 0)
    pledge: int | None = None
    state: RequestState = RequestState.IDLE
    began_s: float = 0.0
    end_s: float = 0.0
    granted_s: float = 0.0
    epochs: dict[str, int] = field(default_factory=dict)
    afterwards: Afterwards = Afterwards.WAIT
    retry_s: float | None = None
    turns: int = 0
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

    @property
    def seniority(self) -> tuple[float, int]:
        """Key among equals: smaller comes first."""
        return self.stamp if self.pledge is None else (-math.inf, self.pledge)

    def served(self, now_s: float) -> bool:
        """Say whether it runs and had its whole slice."""
        return self.state is RequestState.RUNNING and now_s >= self.end_s - INSTANT_S


class Hold(NamedTuple):
    """From when to when somebody stands in the way, as one other ARC sees it."""

    arc: ArcEntry
    start_s: float
    end_s: float

    def covers(self, moment_s: float) -> bool:
        """Say whether it is there at this time."""
        return self.start_s <= moment_s + INSTANT_S and self.end_s > moment_s + INSTANT_S


class Slot(NamedTuple):
    """The place the plan found for an ARC.

    Attributes:
        arc: The ARC.
        start_s: When its RCs begin to settle; infinite: never, as things are.
        against: What stood in its way when the place was found.
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

    def __init__(self, *, tolerance_s: float, strict: bool) -> None:
        """Begin empty.

        Args:
            tolerance_s: By how much two reservations may overlap. Hand-over takes time: without it an
                ARC never fits a gap that is exactly as long as its slice.
            strict: No ARC starts while a higher usable one of its group waits.
        """
        self.rcs: dict[str, RcEntry] = {}
        self.arcs: dict[str, ArcEntry] = {}
        self._slack_s = tolerance_s
        self._strict = strict
        self._admitted: dict[tuple[str, frozenset[str]], bool] = {}
        self._roomy: dict[str, bool] = {}

    def demand_changed(self) -> None:
        """Forget what was worked out about sharable RCs: other ARCs, capacities or priorities count now."""
        self._admitted.clear()
        self._roomy.clear()

    # What fits together (rule 1).

    def fits(self, arc: ArcEntry, others: Iterable[ArcEntry]) -> bool:
        """Say whether the ARC can hold all its RCs together with these others."""
        users: dict[str, list[ArcEntry]] = {rc: [arc] for rc in arc.uses}
        for other in others:
            for rc in arc.uses.keys() & other.uses.keys():
                users[rc].append(other)
        return all(self._can_share(rc, of_rc) for rc, of_rc in users.items())

    def usable(self, arc: ArcEntry) -> bool:
        """Say whether it could run if nobody else were there: its RCs are up and can serve it."""
        return all(self.rcs[rc].up for rc in arc.uses) and self.fits(arc, ())

    def _can_share(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        if not self.rcs[rc].sharable or not all(user.uses[rc].streams for user in users):
            return len(users) == 1
        return self._has_room_for_all(rc) or self._admissible(rc, users)

    def _has_room_for_all(self, rc: str) -> bool:
        """Say whether the whole active demand fits at once (rule 15): then no part of it need be looked at."""
        if rc not in self._roomy:
            users = [arc for arc in self.arcs.values() if arc.active and rc in arc.uses]
            self._roomy[rc] = all(user.uses[rc].streams for user in users) and self._admissible(rc, users)
        return self._roomy[rc]

    def _admissible(self, rc: str, users: Sequence[ArcEntry]) -> bool:
        key = (rc, frozenset(user.name for user in users))
        if key not in self._admitted:
            streams = [
                (user, stream(usage), number) for user in users for number, usage in enumerate(user.uses[rc].streams)
            ]
            ranked = by_precedence(streams, lambda s: s[0].path, lambda s: (s[1].period_us, s[0].name, s[2]))
            self._admitted[key] = admissible([packets for _, packets, _ in ranked], self.rcs[rc].capacity)
        return self._admitted[key]

    # Order and plan (rules 2, 3, 4).

    def groups(self) -> list[list[ArcEntry]]:
        """Return the active ARCs, group by group."""
        found = groups({arc.name: arc.uses.keys() for arc in self.arcs.values() if arc.active})
        return [[self.arcs[name] for name in group] for group in found]

    def in_order(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return ARCs of one group in the order of rule 2."""
        return by_precedence(arcs, lambda arc: arc.path, lambda arc: arc.seniority)

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
        forgiven_s = self._slack_s if slack_s is None else slack_s
        holders = [arc for arc in group if arc.state in CONNECTED or (arc.holds and not handed_over)]
        slots: list[Slot] = []
        for arc in self.in_order([arc for arc in group if arc.queued]):
            against = self._against(arc, holders, slots, now_s)
            from_s = self.free_s(arc, now_s) if arc in holders else now_s
            start_s = self._earliest_s(arc, from_s, against, forgiven_s) if self.usable(arc) else math.inf
            slots.append(Slot(arc, start_s, against))
        return slots

    def stands_until_s(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> float:
        """Return until when the holder stands in the way of the ARC."""
        if holder.state is RequestState.REVOKING:
            return self.free_s(holder, now_s)
        if higher(arc.path, holder.path):
            return now_s
        if higher(holder.path, arc.path):
            return math.inf
        if holder.state is RequestState.CONNECTING:  # its slice begins with its grant: it cannot be over yet
            return max(now_s + SOON_S, holder.began_s + holder.length_s)
        return max(now_s, holder.end_s)

    def free_s(self, revoked: ArcEntry, now_s: float) -> float:
        """Return when the RCs of an ARC that is being revoked are expected to be free."""
        return max(now_s + SOON_S, revoked.since_s + revoked.release_s)

    def _against(self, arc: ArcEntry, holders: Iterable[ArcEntry], slots: Iterable[Slot], now_s: float) -> list[Hold]:
        """Return everybody who shares an RC with the ARC and stands in its way for a time."""
        holds = [
            Hold(holder, -math.inf, self.stands_until_s(holder, arc, now_s))
            for holder in holders
            if holder is not arc and _share_rc(holder, arc)
        ]
        holds += [
            Hold(slot.arc, slot.start_s, math.inf if higher(slot.arc.path, arc.path) else slot.end_s)
            for slot in slots
            if slot.start_s < math.inf and _share_rc(slot.arc, arc)
        ]
        return [hold for hold in holds if hold.end_s > now_s + INSTANT_S]

    def _earliest_s(self, arc: ArcEntry, from_s: float, against: Sequence[Hold], forgiven_s: float) -> float:
        """Return the first time from which the ARC fits for its whole length; infinite if there is none."""
        length_s = arc.length_s - min(forgiven_s, arc.minimum_s / 2)
        times = sorted({from_s, *(hold.end_s for hold in against if from_s < hold.end_s < math.inf)})
        return next(
            (time_s for time_s in times if self._fits_between(arc, time_s, time_s + length_s, against)), math.inf
        )

    def _fits_between(self, arc: ArcEntry, start_s: float, end_s: float, against: Sequence[Hold]) -> bool:
        met = meeting(against, start_s, end_s)
        moments = {start_s, *(hold.start_s for hold in met if hold.start_s > start_s)}
        return all(self.fits(arc, [hold.arc for hold in met if hold.covers(moment)]) for moment in moments)

    # Whose time has come (rules 3, 4, 8).

    def due(self, now_s: float) -> Turn | None:
        """Return the first ARC in order whose time is now, and who must go for it; None if nobody's is."""
        for group in self.groups():
            turn = self._due_in(group, now_s) if any(arc.state is RequestState.WAITING for arc in group) else None
            if turn is not None:
                return turn
        return None

    def _due_in(self, group: Sequence[ArcEntry], now_s: float) -> Turn | None:
        slots = self.plan(group, now_s)
        starting = _starting(slots, now_s)
        if not starting:
            return None
        # A slice is ended only for who fits without forgiveness, however early the hand-overs under way may end:
        # else it might be ended for a gap that closes meanwhile.
        exact = _starting(self.plan(group, now_s, slack_s=0.0), now_s)
        certain = _starting(self.plan(group, now_s, slack_s=0.0, handed_over=True), now_s)
        pending: list[ArcEntry] = []
        for arc in [slot.arc for slot in slots if slot.arc.state is RequestState.WAITING]:
            if self._must_let_higher_go_first(arc, group):
                continue
            if arc in starting or (arc in exact and arc in certain):
                in_the_way = self._in_the_way(arc, pending, group, now_s)
                if in_the_way and arc in certain:
                    return Turn(arc, in_the_way)
                if not in_the_way and arc in starting and self.fits(arc, [h for h in group if h.holds]):
                    return Turn(arc, [])
            if arc in certain:
                pending.append(arc)
        return None

    def _in_the_way(
        self, arc: ArcEntry, pending: Sequence[ArcEntry], group: Sequence[ArcEntry], now_s: float
    ) -> list[ArcEntry]:
        """Return the holders that must go so that the ARC can start, no more than necessary, last in order first.

        Those who only wait for RCs that are being freed (``pending``) count as if they had started:
        else the room made here is theirs in a moment and both would displace each other again and again.
        """
        holders = [holder for holder in group if holder.state in CONNECTED and _share_rc(holder, arc)]
        movable = [holder for holder in holders if self.stands_until_s(holder, arc, now_s) <= now_s + INSTANT_S]
        staying = [holder for holder in holders if holder not in movable] + [p for p in pending if _share_rc(p, arc)]
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

    def _must_let_higher_go_first(self, arc: ArcEntry, group: Sequence[ArcEntry]) -> bool:
        return self._strict and any(
            other.state is RequestState.WAITING and higher(other.path, arc.path) and self.usable(other)
            for other in group
        )

    def next_end_s(self, now_s: float) -> float | None:
        """Return when the next slice ends that somebody may wait for; None: no decision is due without an event."""
        ends = [
            holder.end_s
            for group in self.groups()
            if any(arc.state is RequestState.WAITING for arc in group)
            for holder in group
            if holder.state is RequestState.RUNNING and holder.end_s > now_s + INSTANT_S
        ]
        return min(ends, default=None)

    def blockers(self, slot: Slot, now_s: float) -> list[ArcEntry]:
        """Return the ARCs because of which the ARC cannot start now, those that alone suffice first."""
        met = [hold.arc for hold in meeting(slot.against, now_s, now_s + slot.arc.length_s - self._slack_s)]
        alone = [other for other in met if not self.fits(slot.arc, [other])]
        return alone or met

    def slot_of(self, arc: ArcEntry, now_s: float) -> Slot | None:
        """Return the place of the ARC in the plan; None if it is not queued."""
        group = next((group for group in self.groups() if arc in group), [])
        return next((slot for slot in self.plan(group, now_s) if slot.arc is arc), None)


def meeting(holds: Iterable[Hold], start_s: float, end_s: float) -> list[Hold]:
    """Return the holds that overlap this span."""
    return [hold for hold in holds if hold.start_s < end_s - INSTANT_S and hold.end_s > start_s + INSTANT_S]


def _starting(slots: Iterable[Slot], now_s: float) -> set[ArcEntry]:
    return {slot.arc for slot in slots if slot.start_s <= now_s + INSTANT_S}


def _share_rc(a: ArcEntry, b: ArcEntry) -> bool:
    return not a.uses.keys().isdisjoint(b.uses.keys())
