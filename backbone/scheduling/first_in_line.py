"""First in line: the ARC for which each RC of a large group is reserved, and the begin of that reservation.

Rule of this file: nothing changes. Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.table import Table

LOOK_AHEAD = 3  # chosen: length of a chain of first ARCs that wait for each other; beyond it only holders count


_Line = list[tuple[ArcEntry, bool]]
"""The other ARCs that are first in line at the RCs of an ARC and leave it no room; whether each is higher."""


@dataclass(slots=True, frozen=True)
class _Around:
    """What surrounds an ARC at its RCs.

    Attributes:
        version: Sum of the versions of its RCs, and of their service, at that time.
        holders: The other ARCs that hold its RCs and leave it no room.
        line: Its line.
    """

    version: int
    holders: list[ArcEntry]
    line: _Line


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
        self._looked = -1
        """Version of the state for which the next is known."""
        self._present: dict[ArcEntry, tuple[float, _Line]] = {}
        """ARC → end of its holders' slices, and its line."""
        self._reserved: dict[ArcEntry, float] = {}
        self._firsts: dict[str, tuple[int, ArcEntry | None]] = {}
        self._around: dict[ArcEntry, _Around] = {}

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
        if self._looked != self._state.version:
            self._looked = self._state.version
            self._present.clear()
        self._reserved.clear()  # its reservations were computed for another candidate
        at = {rc: self.at(rc) for rc in arc.uses}
        firsts = dict.fromkeys(first for first in at.values() if first is not None)
        if arc not in firsts and self._takes_from(firsts, arc, holders, now_s):
            return True  # most candidates end here
        users = dict.fromkeys(user for rc in arc.uses for user in self._state.users[rc] if user.queued)
        higher_ones = [one for one in users if one.level is not arc.level and one.goes_before(arc)]
        others = [one for one in higher_ones if one not in firsts]
        if arc in firsts:
            # Equality is not transitive: two ARCs can each be first at a common RC. The lower one then waits.
            higher_waits = any(map(self._table.usable, higher_ones))
            ahead = set() if higher_waits else {rc for rc, first in at.items() if first is arc}
            if self._takes_from([first for first in firsts if ahead.isdisjoint(first.uses)], arc, holders, now_s):
                return True
        else:
            # An ARC for which RCs are being freed is not the first in line behind a higher one.
            others += [one for one in users if self._is_being_freed_for(one, arc)]
        return self._takes_from(others, arc, holders, now_s)

    def _takes_from(self, others: Iterable[ArcEntry], arc: ArcEntry, holders: Sequence[ArcEntry], now_s: float) -> bool:
        """Return whether the run of the ARC, beside those holders that leave it room, would delay one of the others."""
        fits, end_s, shared = self._table.fits, self._must_be_done_s(arc, now_s), arc.touches & ~arc.excludes
        crowd = [holder for holder in holders if holder.touches & shared and fits(arc, [holder])]
        return any(
            self._reserved_s(other, now_s, (arc,)) < end_s
            for other in others
            if other is not arc and not fits(arc, [other, *crowd]) and self._table.usable(other)
        )

    def _is_being_freed_for(self, other: ArcEntry, arc: ArcEntry) -> bool:
        """Return whether RCs are being freed for the other ARC, since before any for this one, which is not higher."""
        own = math.inf if arc.reservation is None else arc.reservation
        return other.reservation is not None and other.reservation < own and not arc.goes_before(other)

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
        start_s, line = self._present.get(arc) or self._look_at(arc, now_s)
        if len(behind) > LOOK_AHEAD or start_s == math.inf:
            return start_s
        for first, is_higher in line:
            if first in behind:
                continue
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < self._must_be_done_s(arc, start_s):
                start_s = math.inf if is_higher else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s

    def _look_at(self, arc: ArcEntry, now_s: float) -> tuple[float, _Line]:
        around, until_s = self._around_of(arc), self._table.stands_until_s
        found = max([now_s, *[until_s(holder, arc, now_s) for holder in around.holders]]), around.line
        self._present[arc] = found
        return found

    def _around_of(self, arc: ArcEntry) -> _Around:
        """Return the neighbors of the ARC at its RCs; they are collected again after a change of one of these RCs."""
        versions = self._state.rc_versions
        version = self._state.service_version + sum([versions.get(rc, 0) for rc in arc.uses])
        known = self._around.get(arc)
        if known is None or known.version != version:
            if len(self._around) > 2 * len(self._state.arcs):
                self._around.clear()  # it may hold ARCs that left
            known = self._around[arc] = self._collected(arc, version)
        return known

    def _collected(self, arc: ArcEntry, version: int) -> _Around:
        table = self._table
        holders = [holder for holder in table.holders(arc) if not table.fits(arc, [holder])]
        firsts = [first for first in map(self.at, arc.uses) if first is not None and first is not arc]
        line = [(first, first.goes_before(arc)) for first in firsts if not table.fits(arc, [first])]
        # RCs freed for it by force are its own; only a higher ARC may need them first.
        return _Around(version, holders, [one for one in line if arc.reservation is None or one[1]])
