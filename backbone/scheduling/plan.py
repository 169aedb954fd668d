"""Plan: the earliest start of each queued ARC of a group, one after the other in their order (rule 3).

Each ARC gets the earliest start at which its whole settling and minimum run time fit, given the holders of its RCs and
the reservations of the ARCs before it. Places are computed on demand, so a question about the first ARC costs no plan
of the last.
"""

from __future__ import annotations

import functools
import math
from bisect import insort
from collections.abc import Collection, Iterable, Sequence

from backbone.scheduling.entries import CONNECTED, INSTANT_S, ArcEntry
from backbone.scheduling.planner import Hold, Slot, Turn
from backbone.scheduling.preemption import in_the_way, must_let_higher_go_first
from backbone.scheduling.priority import rank_of
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table

_Reservation = tuple[float, int, float, ArcEntry]
"""Begin of a reservation, the ARC's place in the order, its end, and the ARC."""


class GroupPlans:
    """The plans of one decision about one group, each made when it is first needed.

    Attributes:
        order: Its queued ARCs, in order.
    """

    def __init__(
        self,
        table: Table,
        order: list[ArcEntry],
        group: Iterable[ArcEntry],
        now_s: float,
        *,
        slack_s: float,
        among_equals: bool = True,
    ) -> None:
        """Plan nothing yet; the arguments are those of ``Plan``."""
        self.order = order
        self._table = table
        self._group = [*group]
        self._now_s = now_s
        self._make = functools.partial(Plan, table, order, self._group, now_s, among_equals=among_equals)
        self._slack_s = slack_s

    def due(self, queued: Sequence[ArcEntry], possible: Collection[ArcEntry]) -> Turn | None:
        """Return the ARC whose time is now, and the holders to revoke for it; None if there is none.

        A slice is ended only for an ARC that fits without tolerance, whenever the present hand-overs end. Otherwise the
        slice might be ended for a gap that closes meanwhile.

        Args:
            queued: The first ARCs of the order, or all.
            possible: ARCs that no single holder prevents from starting now.
        """
        table, now = self._table, self.now
        if not any(now.starts_now(arc) for arc in queued if arc in possible):
            return None
        exact = certain = self._make(slack_s=0.0)
        if any(arc.state is RequestState.REVOKING for arc in self._group):
            certain = self._make(slack_s=0.0, handed_over=True)
        before: list[ArcEntry] = []
        for arc in queued:
            if arc.state is not RequestState.WAITING or must_let_higher_go_first(table, arc):
                continue
            if arc in possible and (now.starts_now(arc) or (exact.starts_now(arc) and certain.starts_now(arc))):
                pending = [other for other in before if certain.starts_now(other)]
                displaced = in_the_way(table, arc, pending, self._group, self._now_s)
                if displaced and certain.starts_now(arc):
                    return Turn(arc, displaced)
                holders = [holder for holder in self._group if holder.holds]
                if not displaced and now.starts_now(arc) and table.fits(arc, holders):
                    return Turn(arc, [])
            before.append(arc)
        return None

    @functools.cached_property
    def now(self) -> Plan:
        """The plan of the present state, with the tolerance of this run."""
        return self._make(slack_s=self._slack_s)


class Plan:
    """The places of the queued ARCs of one group; valid while nothing changes."""

    def __init__(
        self,
        table: Table,
        order: Sequence[ArcEntry],
        group: Iterable[ArcEntry],
        now_s: float,
        *,
        slack_s: float,
        handed_over: bool = False,
        among_equals: bool = True,
    ) -> None:
        """Plan for these ARCs.

        Args:
            order: Queued ARCs of the group, in order.
            group: Active ARCs.
            now_s: Earliest time.
            slack_s: Longest overlap of an ARC with those before it, but at most half its slice.
            handed_over: True: plan as if all RCs that are being freed were free already.
            among_equals: False: a later start binds only lower ARCs; it binds equals, too, if it has a reservation.
        """
        self._table = table
        self._order = order
        self._now_s = now_s
        self._slack_s = slack_s
        self._handed_over = handed_over
        self._among_equals = among_equals
        self._group = group
        self._holders: list[ArcEntry] = []
        self._starts_s: dict[ArcEntry, float] = {}
        self._reserved: list[_Reservation] = []

    def start_s(self, arc: ArcEntry) -> float:
        """Return when an ARC of the order can start; infinite: never in the present state."""
        while arc not in self._starts_s:
            self._find_next()
        return self._starts_s[arc]

    def starts_now(self, arc: ArcEntry) -> bool:
        """Return whether an ARC of the order can start at once."""
        return self.start_s(arc) <= self._now_s + INSTANT_S

    def slots(self) -> list[Slot]:
        """Return all places, in order."""
        return [Slot(arc, self.start_s(arc), self._against(arc, place)) for place, arc in enumerate(self._order)]

    def _find_next(self) -> None:
        place = len(self._starts_s)
        if not place:
            handed_over = self._handed_over
            self._holders = [arc for arc in self._group if arc.state in CONNECTED or (arc.holds and not handed_over)]
        arc = self._order[place]
        start_s = self._starts_s[arc] = self._earliest_s(arc, place)
        if start_s < math.inf:
            insort(self._reserved, (start_s, place, start_s + arc.length_s, arc))

    def _earliest_s(self, arc: ArcEntry, place: int) -> float:
        """Return the first time from which the ARC fits for its whole length; infinite if there is none.

        A higher ARC may stay after its slot. Therefore an ARC that overlaps the slot of a higher one never starts.
        """
        now_s, table = self._now_s, self._table
        if not table.usable(arc):
            return math.inf
        touches, excludes = arc.touches, arc.excludes
        start_s = table.stands_until_s(arc, arc, now_s) if arc.holds and not self._handed_over else now_s
        for holder in self._holders:
            if (holder.touches & excludes or holder.excludes & touches) and holder is not arc:
                until_s = table.stands_until_s(holder, arc, now_s)
                start_s = max(start_s, until_s)
        if start_s == math.inf:
            return math.inf
        length_s = arc.length_s - min(self._slack_s, arc.minimum_s / 2)
        too_late_s = start_s + length_s - INSTANT_S
        for begin_s, _, end_s, other in self._reserved:
            if begin_s >= too_late_s:
                break
            if not (other.touches & excludes or other.excludes & touches):
                continue
            if not (self._among_equals or self._binds(begin_s, other, arc)):
                continue
            if other.level is not arc.level and rank_of(other, arc) > 0:
                return math.inf
            if end_s > start_s:
                start_s = end_s
                too_late_s = start_s + length_s - INSTANT_S
        if not arc.shares or all(table.has_room_for_all(rc) for rc in arc.shares):
            return start_s
        return self._earliest_in_a_crowd_s(arc, start_s, length_s, self._against(arc, place))

    def _binds(self, begin_s: float, other: ArcEntry, arc: ArcEntry) -> bool:
        """Return whether the reservation of the other binds the ARC."""
        if begin_s <= self._now_s + INSTANT_S or other.reservation is not None:
            return True
        return rank_of(other, arc) != 0

    def _against(self, arc: ArcEntry, place: int) -> list[Hold]:
        """Return the ARCs at a common RC that prevent an earlier start, by the state of the search for its place."""
        touches, soon_s = arc.touches, self._now_s + INSTANT_S
        against: list[Hold] = []
        for holder in self._holders:
            if holder.touches & touches and holder is not arc:
                until_s = self._table.stands_until_s(holder, arc, self._now_s)
                if until_s > soon_s:
                    against.append((holder, -math.inf, until_s))
        before = sorted((at, begin_s, end_s, other) for begin_s, at, end_s, other in self._reserved if at < place)
        against += [
            (other, begin_s, end_s)
            for _, begin_s, end_s, other in before
            if other.touches & touches and (self._among_equals or self._binds(begin_s, other, arc))
        ]
        return against

    def _earliest_in_a_crowd_s(self, arc: ArcEntry, from_s: float, length_s: float, against: Sequence[Hold]) -> float:
        """Return the first time at which the sharable RCs have room for the ARC's streams, too."""
        lasting = [
            (other, begin_s, math.inf if begin_s > -math.inf and rank_of(other, arc) > 0 else end_s)
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
            self._table.fits(
                arc,
                [
                    other
                    for other, begin_s, over_s in met
                    if begin_s <= moment_s + INSTANT_S and over_s > moment_s + INSTANT_S
                ],
            )
            for moment_s in moments
        )


def meeting(holds: Iterable[Hold], start_s: float, end_s: float) -> list[Hold]:
    """Return the holds that overlap this span."""
    return [hold for hold in holds if hold[1] < end_s - INSTANT_S and hold[2] > start_s + INSTANT_S]
