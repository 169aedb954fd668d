"""Large group: in a group too large to be planned whole, each RC is reserved only for the first ARC in line.

This is backfilling with a reservation for the first in line (see ``planner``), here at each RC: an ARC starts if its
slice ends before the reserved starts, and may overtake ARCs further back. A decision examines the ARC's own RCs instead
of the whole group.

Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.estimate import estimate
from backbone.scheduling.planner import Slot, Turn
from backbone.scheduling.priority import higher
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table

LOOK_AHEAD = 3  # chosen: length of a chain of first ARCs that wait for each other; beyond it only holders count


class LargeGroupPlanner:
    """Plans one ARC after the other, each beside the ARCs that want the same RCs."""

    is_exact = False
    reserves = False

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with no candidates.

        Args:
            slack_s: By how much two reservations may overlap.
        """
        self._table = table
        self._state = table.state
        self._slack_s = slack_s
        self._candidates: dict[ArcEntry, None] = {}
        self._reserved: dict[ArcEntry, float] = {}
        self._firsts: dict[str, tuple[int, ArcEntry | None]] = {}

    def look_near(self, rc: str) -> None:
        """Make the ARCs that a change of this RC concerns candidates again.

        These are its users, and ARCs that may wait for one of its users at another RC.
        """
        state = self._state
        users = state.users.get(rc, ())
        elsewhere = {other: None for arc in users if arc.queued for other in arc.uses if self._may_hold_up(arc, other)}
        near = dict.fromkeys(users)
        for other in elsewhere:
            near.update((user, None) for user in state.users.get(other, ()) if not state.is_kept_out(user))
        self._candidates.update((arc, None) for arc in near if arc.state is RequestState.WAITING)

    def _may_hold_up(self, arc: ArcEntry, rc: str) -> bool:
        """Return whether another ARC may wait at this free RC only because this one is first in line."""
        if self._state.is_held_alone(rc):
            return False
        first = self._first_at(rc)
        return first is None or first is arc or first.level is not arc.level

    def due(self, now_s: float) -> Turn | None:
        """Return a candidate whose time is now; the others are candidates no more."""
        table = self._table
        while self._candidates:
            arc, _ = self._candidates.popitem()
            holders = self._state.holders(arc)
            if not (arc.state is RequestState.WAITING and table.could_start(arc, holders, now_s) and table.usable(arc)):
                continue
            if self._takes_from_others(arc, now_s) or table.must_let_higher_go_first(arc):
                continue
            staying = [one for one in holders if table.stands_until_s(one, arc, now_s) > now_s + INSTANT_S]
            if not table.fits(arc, staying):
                continue  # each holder alone leaves it room, but all together do not
            in_the_way = table.in_the_way(arc, [], holders, now_s)
            turn = Turn(arc, in_the_way)
            if (in_the_way and not table.runs_on(turn)) or (not in_the_way and table.fits(arc, holders)):
                return turn
        return None

    def _takes_from_others(self, arc: ArcEntry, now_s: float) -> bool:
        """Return whether a start now would take time from a higher ARC or from the first in line at an RC."""
        table, end_s = self._table, self._must_be_done_s(arc, now_s)
        self._reserved.clear()  # its reservations were computed for another candidate
        crowd = [holder for holder in self._crowd(arc) if table.fits(arc, [holder])]

        def from_one(other: ArcEntry) -> bool:
            competes = other is not arc and not table.fits(arc, [other, *crowd]) and table.usable(other)
            return competes and self._reserved_s(other, now_s, (arc,)) < end_s

        higher_ones = [one for one in self._state.beside(arc) if one.goes_before(arc) and one.queued]
        at = {rc: self._first_at(rc) for rc in arc.uses}
        # Equality is not transitive: two ARCs can each be first at a common RC. The lower one then waits.
        ahead = set() if any(map(table.usable, higher_ones)) else {rc for rc, first in at.items() if first is arc}
        firsts = [first for first in dict.fromkeys(at.values()) if first and ahead.isdisjoint(first.uses)]
        return any(from_one(other) for other in dict.fromkeys((*firsts, *higher_ones)))

    def _must_be_done_s(self, arc: ArcEntry, start_s: float) -> float:
        """Return from when on others may need the RCs of an ARC that starts then: hand-overs may eat the slack."""
        return start_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

    def _crowd(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the ARCs that hold a sharable RC of the ARC."""
        return [
            *dict.fromkeys(holder for rc in arc.shares for holder in self._state.rcs[rc].holders if holder is not arc)
        ]

    def _first_at(self, rc: str) -> ArcEntry | None:
        """Return the first ARC in the order of the RC's queue; None if it is empty."""
        version = self._state.version_of(rc)
        known = self._firsts.get(rc)
        if known is None or known[0] != version:
            queued = [user for user in self._state.users.get(rc, ()) if user.queued and self._table.usable(user)]
            known = self._firsts[rc] = version, self._table.first_in_order(queued) if queued else None
        return known[1]

    def _reserved_s(self, arc: ArcEntry, now_s: float, behind: tuple[ArcEntry, ...]) -> float:
        """Return from when its RCs are reserved for the ARC: when its holders end and other first ARCs have run.

        Args:
            now_s: From when on.
            behind: ARCs on the chain so far: they do not wait for themselves, though being equal is not transitive.
        """
        known_s = self._reserved.get(arc)
        if known_s is not None:
            return known_s
        table = self._table
        in_the_way = [holder for holder in self._state.holders(arc) if table.clash(arc, holder)]
        start_s = max([now_s, *(table.stands_until_s(holder, arc, now_s) for holder in in_the_way)])
        if len(behind) > LOOK_AHEAD:
            return start_s
        for rc in arc.uses if start_s < math.inf else ():
            first = self._first_at(rc)
            if first is None or first is arc or first in behind or not table.clash(arc, first):
                continue
            if arc.reservation is not None and not first.goes_before(arc):
                continue  # RCs freed for it by force are its own; only a higher ARC may need them first
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < self._must_be_done_s(arc, start_s):
                start_s = math.inf if first.goes_before(arc) else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s

    def forgotten(self, group: Sequence[ArcEntry], now_s: float) -> ArcEntry | None:
        """Return None: the search for a forgotten turn here would take a plan of the whole group."""
        del group, now_s
        return None

    # Views: which ARCs wait before which, and when an ARC will start.

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return an estimate of the place of every queued ARC of the group, in order."""
        return estimate(self._table, self._table.in_order([arc for arc in group if arc.queued]), now_s)

    def slots_around(self, arc: ArcEntry, now_s: float) -> list[Slot]:
        """Return an estimate of the place of a queued ARC."""
        return estimate(self._table, [*self.before(arc), arc], now_s)[-1:]

    def start_s(self, arc: ArcEntry, now_s: float) -> float:
        """Return an estimate of when the RCs of a queued ARC will begin to settle."""
        return self.slots_around(arc, now_s)[0].start_s

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs that come before a queued one at one of its RCs, in order.

        Under ``strict`` also higher ones anywhere in its group.
        """
        before: dict[ArcEntry, None] = {}
        for rc in arc.uses:
            order = self._table.in_order([user for user in self._state.users.get(rc, ()) if user.queued])
            before.update(dict.fromkeys(order[: order.index(arc)]))
        if self._table.strict:
            group = self._state.group_of(arc)
            before.update((other, None) for other in group if other.queued and higher(other.path, arc.path))
        return self._table.in_order([*before])

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the other ARCs that are first in line at an RC of the ARC."""
        firsts = dict.fromkeys(self._first_at(rc) for rc in arc.uses)
        return [first for first in firsts if first is not None and first is not arc]
