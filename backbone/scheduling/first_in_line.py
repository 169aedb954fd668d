"""First in line: the ARC for which each RC of a large group is reserved, and the begin of that reservation.

Rule of this file: nothing changes. Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from backbone.scheduling.entries import INSTANT_S, SOON_S, ArcEntry
from backbone.scheduling.priority import rank_of
from backbone.scheduling.table import Table

LOOK_AHEAD = 3  # chosen: length of a chain of first ARCs that wait for each other; beyond it only holders count
MOST_LOOKS = 64  # chosen: a reservation that so many looks did not need is computed anew
MOST_KEPT = 8  # chosen: for each ARC; a large group has fewer than two reservations for each, without those that left


_Line = list[tuple[ArcEntry, bool]]
"""The other ARCs that are first in line at the RCs of an ARC and leave it no room; whether each is higher."""


@dataclass(slots=True)
class _Around:
    """What surrounds an ARC at its RCs; every change of it is a change of one of these RCs.

    Attributes:
        version: Sum of the versions of its RCs, and of their service, at that time.
        looked: Version of the state at the last comparison of ``version``.
        end_s: Latest end of the slices of its holders: the other ARCs that hold its RCs and leave it no room.
        soon_s: Shortest time until these are gone: not 0 while one settles or is being revoked.
        ahead: The RCs at which it is first, as a set of bits.
        line: Its line.
    """

    version: int
    looked: int
    end_s: float
    soon_s: float
    ahead: int
    line: _Line


_Place = tuple[ArcEntry, int]
"""An ARC, and the length of the chain of first ARCs that count before it."""


class _Chain(NamedTuple):
    """ARCs of which each waits for the next; they do not wait for themselves, although equality is not transitive.

    Attributes:
        arcs: The ARCs, the candidate first.
        ahead: The RCs at which one of them is first, as a set of bits.
    """

    arcs: tuple[ArcEntry, ...]
    ahead: int


@dataclass(slots=True)
class _Reserved:
    """When the RCs are reserved for an ARC.

    Attributes:
        start_s: Begin of the reservation.
        rcs: The RCs on which it depends, as a set of bits.
        until_s: Last time at which it stands, while none of these RCs changes.
        looked: Number of the look at the state that found it standing last.
    """

    start_s: float
    rcs: int
    until_s: float
    looked: int


_Found = tuple[ArcEntry, _Reserved]
"""An ARC and its reservation."""


class _Delayed(NamedTuple):
    """Why an ARC could not start when this was last asked.

    Attributes:
        other: The ARC whose reservation a start would delay, the first to ask about again.
        reserved: That reservation, which depends on the RCs of the ARC, too; None: the answer is not kept.
    """

    other: ArcEntry
    reserved: _Reserved | None


class FirstInLine:
    """The reservations of the first ARCs at the RCs.

    What it keeps changes no answer, so a snapshot contains only ``_firsts``: under the discipline ``time`` the order at
    an RC is that of the first question after the RC's last change.
    """

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with no known first ARC.

        Args:
            slack_s: Longest overlap of two reservations.
        """
        self._table = table
        self._state = table.state
        self._slack_s = slack_s
        self._by_time = table.state.fairness.discipline == "time"
        self._looked, self._looked_s = 0, -math.inf
        """Number of looks at the state, and the time of the last one."""
        self._changes: list[int] = []
        """The RCs that changed before each of the last looks, as sets of bits."""
        self._service_version = -1
        self._reserved: dict[_Place, _Reserved] = {}
        self._firsts: dict[str, tuple[int, ArcEntry | None]] = {}
        self._around: dict[ArcEntry, _Around] = {}
        self._delayed: dict[ArcEntry, _Delayed] = {}

    def at(self, rc: str) -> ArcEntry | None:
        """Return the first ARC in the order of the RC's queue; None if it is empty."""
        version = self._state.rc_versions.get(rc, 0) + self._state.service_version
        known = self._firsts.get(rc)
        if known is None or known[0] != version:
            queued = [user for user in self._state.users.get(rc, ()) if user.queued and self._table.usable(user)]
            known = self._firsts[rc] = version, self._table.first_in_order(queued) if queued else None
        return known[1]

    def is_first_without(self, rc: str, joined: Sequence[ArcEntry]) -> bool:
        """Return whether the first ARC at the RC would be the first without these, too; False also if it is unknown.

        Under the discipline ``time`` it is unknown: there the question itself fixes the order.
        """
        first = None if self._by_time else self.at(rc)
        if first is None or first in joined:
            return False
        new = set(joined)  # after a restart of the RC manager all ARCs join at once
        others = [user for user in self._state.users[rc] if user.queued and user not in new]
        return self._table.first_in_order([user for user in others if self._table.usable(user)]) is first

    def takes_from_others(self, arc: ArcEntry, now_s: float) -> bool:
        """Return whether a start of a waiting ARC now would take time from a higher one or from the first in line."""
        self._look(now_s)
        if self._makes_way(arc) or self._still_delays(arc):
            return True
        at = {rc: self.at(rc) for rc in arc.uses}
        chain = _Chain((arc,), self._ahead(arc, at))
        found = self._delayed_by(chain, at, now_s)
        if found is None:
            return False
        other, reserved = found
        is_kept, rcs = not reserved.rcs & chain.ahead, reserved.rcs | arc.touches
        kept = _Reserved(reserved.start_s, rcs, reserved.until_s, self._looked) if is_kept else None
        self._delayed[arc] = _Delayed(other, kept)
        return True

    def _look(self, now_s: float) -> None:
        """Take note of the time and of all changes since the last look; reservations that they concern are outdated."""
        state = self._state
        changed, state.concerned = state.concerned, 0
        if not changed and now_s == self._looked_s:
            return
        for kept in (self._reserved, self._around, self._delayed):
            if len(kept) > MOST_KEPT * len(state.arcs):
                kept.clear()  # they may hold ARCs that left
        self._looked += 1
        self._looked_s = now_s
        self._changes = [*self._changes[-MOST_LOOKS:], changed]
        if self._by_time or self._service_version != state.service_version:
            self._service_version = state.service_version
            self._reserved.clear()
            self._delayed.clear()

    def _makes_way(self, arc: ArcEntry) -> bool:
        """Return whether the ARC was revoked twice for one that still waits for these RCs, and lets it go first now.

        A start can change the estimates, so that it is revoked again: without this, again and again.
        """
        if arc.made_way < 2:
            return False
        other = self._state.arcs.get(arc.made_way_for[0])
        return (
            other is not None
            and other.reservation is not None
            and other.stamp == arc.made_way_for[1]
            and other.goes_before(arc)
            and not self._table.fits(arc, [other])
            and self._table.usable(other)
            and self._around_of(other).end_s < math.inf  # else a higher holder keeps it from starting
        )

    def _still_delays(self, arc: ArcEntry) -> bool:
        """Return whether the earlier answer stands: what a start would delay has only come nearer. False: unknown."""
        known = self._delayed.get(arc)
        return known is not None and known.reserved is not None and self._stands(known.reserved)

    def _delayed_by(self, chain: _Chain, at: Mapping[str, ArcEntry | None], now_s: float) -> _Found | None:
        """Return the first reservation found that a start of the candidate now would delay; None if there is none."""
        (arc,) = chain.arcs
        firsts = dict.fromkeys(first for first in at.values() if first is not None)
        if arc in self._delayed:
            last = self._delayed[arc].other
            is_higher = last.queued and last.touches & arc.touches and last.goes_before(arc)
            if is_higher or (last in firsts and arc not in firsts):  # then it counts, and mostly it is it again
                delayed = self._first_delayed([last], chain, now_s)
                if delayed is not None:
                    return delayed
        if arc not in firsts:
            delayed = self._first_delayed(firsts, chain, now_s)
            if delayed is not None:
                return delayed
        users = dict.fromkeys(user for rc in arc.uses for user in self._state.users[rc] if user.queued)
        higher_ones = [one for one in users if one.level is not arc.level and rank_of(arc, one) < 0]
        others = [one for one in higher_ones if one not in firsts]
        if arc in firsts:
            # Equality is not transitive: two ARCs can each be first at a common RC. The lower one then waits.
            higher_waits = any(map(self._table.usable, higher_ones))
            ahead = set() if higher_waits else {rc for rc, first in at.items() if first is arc}
            delayed = self._first_delayed([one for one in firsts if ahead.isdisjoint(one.uses)], chain, now_s)
            if delayed is not None:
                return delayed
        else:
            # An ARC for which RCs are being freed is not the first in line behind a higher one.
            others += [one for one in users if self._is_being_freed_for(one, arc)]
        return self._first_delayed(others, chain, now_s)

    def _first_delayed(self, others: Iterable[ArcEntry], chain: _Chain, now_s: float) -> _Found | None:
        """Return the first of the others' reservations that the candidate, beside holders with room for it, delays."""
        (arc,) = chain.arcs
        fits, end_s = self._table.fits, self._must_be_done_s(arc, now_s)
        sharers = dict.fromkeys(holder for rc in arc.shares for holder in self._state.rcs[rc].holders)
        crowd = [holder for holder in sharers if holder is not arc and fits(arc, [holder])]
        for other in others:
            beside = dict.fromkeys([other, *crowd])  # a holder that is being revoked can be the first in line again
            if other is not arc and not fits(arc, beside) and self._table.usable(other):
                reserved = self._reserved_at((other, LOOK_AHEAD), chain, now_s)
                if reserved.start_s < end_s:
                    return other, reserved
        return None

    def _is_being_freed_for(self, other: ArcEntry, arc: ArcEntry) -> bool:
        """Return whether RCs are being freed for the other ARC, since before any for this one, which is not higher."""
        own = math.inf if arc.reservation is None else arc.reservation
        return other.reservation is not None and other.reservation < own and not arc.goes_before(other)

    def _must_be_done_s(self, arc: ArcEntry, start_s: float) -> float:
        """Return when others may need the RCs of an ARC that starts then; hand-overs may use up the slack."""
        return start_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

    def _stands(self, known: _Reserved) -> bool:
        """Return whether a reservation is still true; False also if it is too old to tell."""
        looks = self._looked - known.looked
        if not looks:
            return True
        if looks > MOST_LOOKS or self._looked_s > known.until_s:
            return False
        rcs = known.rcs
        for changed in self._changes[-looks:]:
            if rcs & changed:
                return False
        known.looked = self._looked
        return True

    def _reserved_at(self, place: _Place, behind: _Chain, now_s: float) -> _Reserved:
        """Return when the RCs are reserved for an ARC: after its holders' slices and the runs of other first ARCs.

        Args:
            behind: The ARCs that wait for it; they do not count.
            now_s: Earliest time.
        """
        known = self._reserved.get(place)
        if known is not None and not known.rcs & behind.ahead and self._stands(known):
            return known
        arc, links = place
        around, rcs = self._around_of(arc), arc.touches
        start_s = max(now_s + around.soon_s, around.end_s)
        until_s = max(now_s, around.end_s - around.soon_s)
        line = around.line if links and start_s < math.inf else ()
        chain = _Chain((*behind.arcs, arc), behind.ahead | around.ahead)
        for first, is_higher in line:
            if first in behind.arcs:
                continue
            before = self._reserved_at((first, links - 1), chain, now_s)
            rcs |= before.rcs
            until_s = min(until_s, before.until_s)
            if before.start_s < self._must_be_done_s(arc, start_s):
                start_s = math.inf if is_higher else max(start_s, before.start_s + first.length_s)
        found = _Reserved(start_s, rcs, until_s, self._looked)
        if not rcs & behind.ahead:  # else it depends on who waits for it
            self._reserved[place] = found
        return found

    def _ahead(self, arc: ArcEntry, at: Mapping[str, ArcEntry | None]) -> int:
        """Return the RCs at which the ARC is first, as a set of bits."""
        return sum(self._state.bits[rc] for rc, first in at.items() if first is arc)

    def _version_at(self, arc: ArcEntry) -> int:
        """Return a number that grows with every change that concerns an RC of the ARC."""
        versions = self._state.rc_versions
        return self._state.service_version + sum([versions.get(rc, 0) for rc in arc.uses])

    def _around_of(self, arc: ArcEntry) -> _Around:
        """Return the neighbors of the ARC at its RCs; they are collected again after a change of one of these RCs."""
        state, known = self._state, self._around.get(arc)
        if known is not None and known.looked == state.version:
            return known
        version = self._version_at(arc)
        if known is None or known.version != version:
            known = self._around[arc] = self._collected(arc, version)
        known.looked = state.version
        return known

    def _collected(self, arc: ArcEntry, version: int) -> _Around:
        table = self._table
        holders = [holder for holder in table.holders(arc) if not table.fits(arc, [holder])]
        at = {rc: self.at(rc) for rc in arc.uses}
        firsts = [first for first in at.values() if first is not None and first is not arc]
        line = [(first, first.goes_before(arc)) for first in firsts if not table.fits(arc, [first])]
        # RCs freed for it by force are its own; only a higher ARC may need them first.
        line = [one for one in line if arc.reservation is None or one[1]]
        end_s = max([table.stands_until_s(holder, arc, -math.inf) for holder in holders], default=-math.inf)
        soon_s = SOON_S if any(table.stands_beyond_now(holder, arc) for holder in holders) else 0.0
        return _Around(version, self._state.version, end_s, soon_s, self._ahead(arc, at), line)
