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
from collections.abc import Iterable, Sequence
from operator import attrgetter

from backbone.scheduling.entries import CONNECTED, INSTANT_S, SOON_S, ArcEntry
from backbone.scheduling.planner import Turn
from backbone.scheduling.priority import by_precedence, rank
from backbone.scheduling.requests import RequestState
from backbone.scheduling.state import ScheduleState

_PATH = attrgetter("path")


class Table:
    """Questions about one state; nothing changes.

    Attributes:
        strict: No ARC starts while a higher usable one of its group waits.
        fits: See ``Compatibility.fits``.
        clash: See ``Compatibility.clash``.
        usable: See ``Compatibility.usable``.
        has_room_for_all: See ``Compatibility.has_room_for_all``.
    """

    def __init__(self, state: ScheduleState, *, strict: bool) -> None:
        """Ask this state.

        Args:
            strict: No ARC starts while a higher usable one of its group waits.
        """
        self.state = state
        self.strict = strict
        self.fits = state.compatibility.fits
        self.clash = state.compatibility.clash
        self.usable = state.compatibility.usable
        self.has_room_for_all = state.compatibility.has_room_for_all

    # Order (rule 2).

    def in_order(self, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return ARCs of one group in the order of rule 2; ARCs with a reservation sort first."""
        fairness, now_s = self.state.fairness, self.state.now_s
        seniority = {arc: fairness.seniority(arc, now_s) for arc in arcs}
        ordered = by_precedence(arcs, _PATH, seniority.__getitem__)
        for reserved in [arc for arc in ordered if arc.reservation is not None]:
            # A higher ARC that cannot run at all does not keep an ARC from the RCs freed for it.
            if not any(self.usable(other) and other.goes_before(reserved) for other in arcs):
                ordered.remove(reserved)
                ordered.insert(0, reserved)
        return ordered

    def first_in_order(self, arcs: Sequence[ArcEntry]) -> ArcEntry:
        """Return the first of ARCs of one group, at least one, in the order of rule 2."""
        if any(arc.reservation is not None for arc in arcs):
            return self.in_order(arcs)[0]
        fairness, now_s = self.state.fairness, self.state.now_s
        by_age = sorted(arcs, key=lambda arc: fairness.seniority(arc, now_s))
        return next(arc for arc in by_age if not any(other.goes_before(arc) for other in arcs))

    def must_let_higher_go_first(self, arc: ArcEntry) -> bool:
        """Return whether the policy ``strict`` holds the ARC back: a higher usable one of its group waits."""
        return self.strict and any(
            other.state is RequestState.WAITING and other.goes_before(arc) and self.usable(other)
            for other in self.state.groups.of[arc].arcs
        )

    # Blockers (rule 4).

    def stands_until_s(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> float:
        """Return until when the holder blocks the ARC."""
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
        """Return whether the RCs of the ARC should have been free by now."""
        return arc.state is RequestState.REVOKING and now_s > arc.since_s + arc.release_s

    def could_start(self, arc: ArcEntry, holders: Iterable[ArcEntry], now_s: float) -> bool:
        """Return whether no incompatible ARC of these holds an RC of it for longer than until now."""
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

    def runs_on(self, turn: Turn) -> bool:
        """Return whether the discipline prefers one of the blocking equals to the ARC whose turn it would be."""
        equals = [holder for holder in turn.in_the_way if not rank(holder.path, turn.arc.path)]
        return any(self.state.runs_on(holder) for holder in equals)

    def in_the_way(
        self, arc: ArcEntry, pending: Sequence[ArcEntry], group: Sequence[ArcEntry], now_s: float
    ) -> list[ArcEntry]:
        """Return the holders to revoke so that the ARC can start, no more than necessary.

        Lower ones go first, the last in order first; then equals whose slices are over, the one granted first first
        (rule 5): so each of several equals on a sharable RC stays for the same number of slices.

        ARCs that only wait for RCs that are being freed (``pending``) count as started: else they would get the
        room made here a moment later, and both would displace each other again and again.
        """
        holders = [holder for holder in group if holder.state in CONNECTED and holder.touches & arc.touches]
        movable = [holder for holder in holders if self.stands_until_s(holder, arc, now_s) <= now_s + INSTANT_S]
        staying = [holder for holder in holders if holder not in movable] + [
            p for p in pending if p.touches & arc.touches
        ]
        equals = [holder for holder in movable if holder.level is arc.level or not rank(holder.path, arc.path)]
        latest = by_precedence(equals, _PATH, lambda holder: (-holder.granted_s, -holder.stamp[0], -holder.stamp[1]))
        lower = self.in_order([holder for holder in movable if holder not in equals])
        return self._without(arc, staying, [*latest, *lower])

    def left_over(self, arc: ArcEntry, staying: Sequence[ArcEntry], movable: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return those of the movable holders that do not fit beside the ARC, last in order first."""
        return self._without(arc, staying, self.in_order(movable))

    def _without(self, arc: ArcEntry, staying: Sequence[ArcEntry], movable: Sequence[ArcEntry]) -> list[ArcEntry]:
        """Return who does not fit beside the ARC if those first in this order stay; last in order first."""
        kept, left = list(staying), []
        for holder in movable:
            if self.fits(arc, [*kept, holder]):
                kept.append(holder)
            else:
                left.append(holder)
        return left[::-1]

    def overloading(self, rc: str) -> list[ArcEntry]:
        """Return the holders the RC cannot serve beside those before them in order, last first."""
        holders = [h for h in self.state.arcs.values() if h.state in CONNECTED and rc in h.uses]
        kept: list[ArcEntry] = []
        left: list[ArcEntry] = []
        for holder in self.in_order(holders):
            (kept if self.state.compatibility.can_share(rc, [*kept, holder]) else left).append(holder)
        return left[::-1]

    def understating(self, rc: str, joining: Sequence[ArcEntry] = ()) -> list[ArcEntry]:
        """Return the connected ARCs that must ask anew, so that the RC serves the rest by measured packet times.

        Only ARCs whose packets take longer than their requests say, the last in order first, no more than necessary.

        Args:
            joining: An ARC that is about to be connected, too.
        """
        kept = [holder for holder in self.state.rcs[rc].holders if holder.state in CONNECTED] + [*joining]
        asked: list[ArcEntry] = []
        for holder in self.in_order([one for one in kept if one.understates and one not in joining])[::-1]:
            if self.state.compatibility.serves_measured(rc, kept):
                break
            kept.remove(holder)
            asked.append(holder)
        return asked
