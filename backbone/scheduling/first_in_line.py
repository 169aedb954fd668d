"""First in line: whose time has come in a group that is too big to be planned whole.

Each RC is reserved for the first in line at it only: an ARC starts if it is done before those would
start, and may overtake who stands further back. That takes a look at the ARC's own RCs instead of at
the whole group.

Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.plan import Turn
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table

LOOK_AHEAD = 3  # chosen: how many first ones may wait for each other before the present holders alone tell


class FirstInLine:
    """Looks at one ARC after the other, each beside those that want the same RCs."""

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with nobody to look at.

        Args:
            table: Who is there, and what fits together.
            slack_s: By how much two reservations may overlap.
        """
        self._table = table
        self._slack_s = slack_s
        self._candidates: dict[ArcEntry, None] = {}
        self._reserved: dict[ArcEntry, float] = {}
        self._firsts: dict[str, ArcEntry | None] = {}

    def forget(self, rcs: Iterable[str]) -> None:
        """Look again for who is first in line at these RCs."""
        for rc in rcs:
            self._firsts.pop(rc, None)

    def look_near(self, rc: str) -> None:
        """Look at those for whom it matters what happened to this RC.

        That is who uses it, and who may have let one of those go first at another RC.
        """
        table = self._table
        users = table.users(rc)
        elsewhere = {other: None for arc in users if arc.queued for other in arc.uses if self._may_hold_up(arc, other)}
        near = dict.fromkeys(users)
        for other in elsewhere:
            near.update((user, None) for user in table.users(other) if not table.is_kept_out(user))
        self._candidates.update((arc, None) for arc in near if arc.state is RequestState.WAITING)

    def _may_hold_up(self, arc: ArcEntry, rc: str) -> bool:
        """Say whether somebody may have let the ARC go first at the RC, which would be free."""
        if self._table.is_held(rc):
            return False
        first = self.at(rc)
        return first is None or first is arc or first.level is not arc.level

    def due(self, now_s: float) -> Turn | None:
        """Return a candidate whose time is now; the others are candidates no more."""
        table = self._table
        self._reserved.clear()  # nothing changes while they are looked at
        while self._candidates:
            arc, _ = self._candidates.popitem()
            holders = table.holders(arc)
            if not (arc.state is RequestState.WAITING and table.could_start(arc, holders, now_s) and table.usable(arc)):
                continue
            if self._takes_from_others(arc, now_s) or table.must_let_higher_go_first(arc):
                continue
            staying = [one for one in holders if table.stands_until_s(one, arc, now_s) > now_s + INSTANT_S]
            if not table.fits(arc, staying):
                continue  # one by one they would let it in, but not together
            in_the_way = table.in_the_way(arc, [], holders, now_s)
            if in_the_way or table.fits(arc, holders):
                return Turn(arc, in_the_way)
        return None

    def _takes_from_others(self, arc: ArcEntry, now_s: float) -> bool:
        """Say whether, if it started now, it would take time from a higher one or from the first in line at an RC."""
        end_s = self._must_be_done_s(arc, now_s)
        crowd = [holder for holder in self._crowd(arc) if self._table.fits(arc, [holder])]

        def from_one(other: ArcEntry) -> bool:
            competes = other is not arc and not self._table.fits(arc, [other, *crowd]) and self._table.usable(other)
            return competes and self._reserved_s(other, now_s, (arc,)) < end_s

        firsts = [first for first in dict.fromkeys(self.at(rc) for rc in arc.uses) if first is not None]
        firsts.sort(key=self._reserved.__contains__, reverse=True)  # one that is known may tell enough
        if any(from_one(first) for first in firsts):
            return True
        return any(from_one(one) for one in self._table.beside(arc) if one.goes_before(arc) and one.queued)

    def _must_be_done_s(self, arc: ArcEntry, start_s: float) -> float:
        """Return from when on others may need the RCs of an ARC that starts then: hand-overs may eat the slack."""
        return start_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

    def _crowd(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return those that hold a sharable RC of the ARC."""
        return [
            *dict.fromkeys(holder for rc in arc.shares for holder in self._table.rcs[rc].holders if holder is not arc)
        ]

    def at(self, rc: str) -> ArcEntry | None:
        """Return the first in order of those queued for the RC; None if nobody is."""
        if rc not in self._firsts:
            queued = [user for user in self._table.users(rc) if user.queued and self._table.usable(user)]
            self._firsts[rc] = self._table.first_in_order(queued) if queued else None
        return self._firsts[rc]

    def _reserved_s(self, arc: ArcEntry, now_s: float, behind: tuple[ArcEntry, ...]) -> float:
        """Return from when its RCs are reserved for the ARC: when its holders go and others first in line have run.

        Args:
            arc: The ARC.
            now_s: From when on.
            behind: Those that asked for this: they do not wait for themselves, though being equal is not transitive.
        """
        known_s = self._reserved.get(arc)
        if known_s is not None:
            return known_s
        table = self._table
        in_the_way = [holder for holder in table.holders(arc) if table.clash(arc, holder)]
        start_s = max([now_s, *(table.stands_until_s(holder, arc, now_s) for holder in in_the_way)])
        if len(behind) > LOOK_AHEAD or arc.reservation is not None:  # what is freed for it by force is nobody else's
            return start_s
        for rc in arc.uses if start_s < math.inf else ():
            first = self.at(rc)
            if first is None or first is arc or first in behind or not table.clash(arc, first):
                continue
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < self._must_be_done_s(arc, start_s):
                start_s = math.inf if first.goes_before(arc) else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s
