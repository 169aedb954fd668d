"""Table: questions about the present schedule: compatible ARCs, their order, and blockers.

The planners find the time of an ARC.

Rules of this file (numbers as in docs and ``why``):

* 1  All or nothing: one holder of an exclusive RC; every stream of every holder meets its deadline.
* 2  Order: oldest stamp first, but no ARC before one that is higher.
* 4  Lower-priority holders never delay a higher-priority ARC: they block it only until now.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import attrgetter

from backbone.scheduling.entries import INSTANT_S, SOON_S, ArcEntry
from backbone.scheduling.fairness import Seniority
from backbone.scheduling.planner import Turn
from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.priority import Level, rank_of
from backbone.scheduling.requests import RequestState
from backbone.scheduling.state import ScheduleState

_PATH = attrgetter("path")


class Table:
    """Questions about one state, which does not change.

    Attributes:
        strict: No ARC starts while a higher usable one of its group waits.
        fits: See ``Compatibility.fits``.
        usable: See ``Compatibility.usable``.
        has_room_for_all: See ``Compatibility.has_room_for_all``.
    """

    def __init__(self, state: ScheduleState, *, strict: bool) -> None:
        """Answer about this state.

        Args:
            strict: No ARC starts while a higher usable one of its group waits.
        """
        self.state = state
        self.strict = strict
        self.fits = state.compatibility.fits
        self.usable = state.compatibility.usable
        self.has_room_for_all = state.compatibility.has_room_for_all

    # Order (rule 2).

    def in_order(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return ARCs of one group in the order of rule 2; ARCs with a reservation sort first."""
        reserved, fairness, now_s = self._with_reservation(arcs), self.state.fairness, self.state.now_s
        seniority = {arc: fairness.seniority(arc, now_s) for arc in arcs}
        ordered = by_precedence(arcs, _PATH, seniority.__getitem__)
        for arc in [arc for arc in ordered if arc in reserved] if reserved else ():
            ordered.remove(arc)
            ordered.insert(0, arc)
        return ordered

    def first_in_order(self, arcs: Sequence[ArcEntry]) -> ArcEntry:
        """Return the first of ARCs of one group, at least one, in the order of rule 2."""
        reserved = self._with_reservation(arcs)
        if len(reserved) > 1:
            return self.in_order(arcs)[0]
        if reserved:
            return reserved[0]
        seniority, now_s = self.state.fairness.seniority, self.state.now_s
        eldest: dict[Level, tuple[Seniority, int, ArcEntry]] = {}
        for place, arc in enumerate(arcs):
            one, known = (seniority(arc, now_s), place, arc), eldest.get(arc.level)
            if known is None or one < known:
                eldest[arc.level] = one
        by_age = [arc for _, _, arc in sorted(eldest.values())]  # what is higher than one of a level is than all of it
        return next(
            arc for arc in by_age if not any(other.level is not arc.level and rank_of(other, arc) > 0 for other in arcs)
        )

    def _with_reservation(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return those of these ARCs that sort first: RCs are freed for them, and no higher one may need these."""
        return [
            arc
            for arc in arcs
            if arc.reservation is not None
            # A higher ARC that cannot run at all does not keep an ARC from the RCs freed for it.
            and not any(other.goes_before(arc) and self.usable(other) for other in arcs)
        ]

    # Blockers (rule 4).

    def stands_until_s(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> float:
        """Return how long the holder, or the ARC itself while its RCs are being freed, blocks the ARC."""
        if holder.state is RequestState.REVOKING:
            return max(now_s + SOON_S, holder.since_s + holder.release_s)
        before = 0 if holder.level is arc.level else rank_of(holder, arc)
        if before:
            return math.inf if before > 0 else now_s
        if holder.state is RequestState.CONNECTING:  # its slice begins with its grant, so it cannot be over yet
            return max(now_s + SOON_S, holder.began_s + holder.length_s)
        return max(now_s, holder.end_s)

    def stands_beyond_now(self, holder: ArcEntry, arc: ArcEntry) -> bool:
        """Return whether the holder blocks the ARC beyond the present time, even if it should be gone by now."""
        if holder.state is RequestState.CONNECTING:
            return not arc.goes_before(holder)
        return holder.state is RequestState.REVOKING

    def is_overdue(self, arc: ArcEntry, now_s: float) -> bool:
        """Return whether the RCs of the ARC should have been free by now."""
        return arc.state is RequestState.REVOKING and now_s > arc.since_s + arc.release_s

    def holders(self, arc: ArcEntry) -> Iterator[ArcEntry]:
        """Yield the other ARCs that hold an RC of the ARC."""
        rcs, known = self.state.rcs, {arc}
        for rc in arc.uses:
            for holder in rcs[rc].holders:
                if holder not in known:
                    known.add(holder)
                    yield holder

    def could_start(self, arc: ArcEntry, holders: Iterable[ArcEntry], now_s: float) -> bool:
        """Return whether none of these holders blocks the ARC beyond now."""
        return self.blocker(arc, holders, now_s) is None

    def blocker(self, arc: ArcEntry, holders: Iterable[ArcEntry], now_s: float) -> ArcEntry | None:
        """Return the first of these holders that blocks the ARC beyond now; None if there is none."""
        touches, soon_s = arc.touches, now_s + INSTANT_S
        for holder in holders:
            if (
                holder.touches & touches
                and holder is not arc
                and self.stands_until_s(holder, arc, now_s) > soon_s
                and not self.fits(arc, [holder])
            ):
                return holder
        return None

    def line(
        self, group: Iterable[ArcEntry], now_s: float, order: Callable[[Iterable[ArcEntry]], list[ArcEntry]]
    ) -> tuple[list[ArcEntry], set[ArcEntry]]:
        """Return the queued ARCs of a group, in order, and those that no single holder prevents from starting now.

        If there are none of the latter, the order is not computed, and is empty.

        Args:
            group: Active ARCs of one group.
            now_s: Time of their start.
            order: ARCs → the queued ones, in order.
        """
        holders = [arc for arc in group if arc.holds]
        waiting = (arc for arc in group if arc.state is RequestState.WAITING)
        possible = {arc for arc in waiting if self.could_start(arc, holders, now_s)}
        return order(group) if possible else [], possible

    def runs_on(self, turn: Turn) -> bool:
        """Return whether the discipline prefers one of the blocking equals to the ARC whose turn it would be."""
        equals = [holder for holder in turn.in_the_way if not rank_of(holder, turn.arc)]
        return any(self.state.runs_on(holder) for holder in equals)
