"""First in line: the ARC for which each RC of a large group is reserved, and the begin of that reservation.

Rule of this file: nothing changes. Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.table import Table

LOOK_AHEAD = 3  # chosen: length of a chain of first ARCs that wait for each other; beyond it only holders count


class FirstInLine:
    """The reservations of the first ARCs at the RCs."""

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with no known first ARC.

        Args:
            slack_s: Longest overlap of two reservations.
        """
        self._table = table
        self._state = table.state
        self._slack_s = slack_s
        self._reserved: dict[ArcEntry, float] = {}
        self._firsts: dict[str, tuple[int, ArcEntry | None]] = {}

    def at(self, rc: str) -> ArcEntry | None:
        """Return the first ARC in the order of the RC's queue; None if it is empty."""
        version = self._state.rc_versions.get(rc, 0) + self._state.service_version
        known = self._firsts.get(rc)
        if known is None or known[0] != version:
            queued = [user for user in self._state.users.get(rc, ()) if user.queued and self._table.usable(user)]
            known = self._firsts[rc] = version, self._table.first_in_order(queued) if queued else None
        return known[1]

    def takes_from_others(self, arc: ArcEntry, holders: Sequence[ArcEntry], now_s: float) -> bool:
        """Return whether a start now would take time from a higher ARC or from the first in line at an RC.

        Args:
            arc: A waiting ARC.
            holders: The other ARCs that hold an RC of it.
            now_s: Time of its start.
        """
        table, end_s = self._table, self._must_be_done_s(arc, now_s)
        self._reserved.clear()  # its reservations were computed for another candidate
        users = dict.fromkeys(user for rc in arc.uses for user in self._state.users[rc])
        higher_ones = [one for one in users if one.queued and one.level is not arc.level and one.goes_before(arc)]
        at = {rc: self.at(rc) for rc in arc.uses}
        # Equality is not transitive: two ARCs can each be first at a common RC. The lower one then waits.
        ahead = set() if any(map(table.usable, higher_ones)) else {rc for rc, first in at.items() if first is arc}
        firsts = [first for first in dict.fromkeys(at.values()) if first and ahead.isdisjoint(first.uses)]
        shared = arc.touches & ~arc.excludes
        crowd = [holder for holder in holders if holder.touches & shared and table.fits(arc, [holder])]
        return any(
            self._reserved_s(other, now_s, (arc,)) < end_s
            for other in dict.fromkeys((*firsts, *higher_ones))
            if other is not arc and not table.fits(arc, [other, *crowd]) and table.usable(other)
        )

    def _must_be_done_s(self, arc: ArcEntry, start_s: float) -> float:
        """Return when others may need the RCs of an ARC that starts then; hand-overs may use up the slack."""
        return start_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

    def _reserved_s(self, arc: ArcEntry, now_s: float, behind: tuple[ArcEntry, ...]) -> float:
        """Return when the RCs are reserved for the ARC: after its holders' slices and the runs of other first ARCs.

        Args:
            now_s: Earliest time.
            behind: ARCs on the chain so far. They do not wait for themselves, although equality is not transitive.
        """
        known_s = self._reserved.get(arc)
        if known_s is not None:
            return known_s
        table = self._table
        in_the_way = [holder for holder in table.holders(arc) if not table.fits(arc, [holder])]
        start_s = max([now_s, *(table.stands_until_s(holder, arc, now_s) for holder in in_the_way)])
        if len(behind) > LOOK_AHEAD:
            return start_s
        for rc in arc.uses if start_s < math.inf else ():
            first = self.at(rc)
            if first is None or first is arc or first in behind or table.fits(arc, [first]):
                continue
            if arc.reservation is not None and not first.goes_before(arc):
                continue  # RCs freed for it by force are its own; only a higher ARC may need them first
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < self._must_be_done_s(arc, start_s):
                start_s = math.inf if first.goes_before(arc) else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s
