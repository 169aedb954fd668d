"""First in line: whose time has come in a group that is too big to be planned whole.

Each RC is reserved for the first in line at it only: an ARC starts if it is done before those would
start, and may overtake who stands further back. That takes a look at the ARC's own RCs instead of at
the whole group.

Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from backbone.rc_manager.above import Above
from backbone.rc_manager.entries import INSTANT_S, ArcEntry
from backbone.rc_manager.messages import RequestState
from backbone.rc_manager.plan import Hold, Slot, Turn
from backbone.rc_manager.priority import higher
from backbone.rc_manager.table import Table

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
        """Look at those for whom it matters what happened to this RC."""
        self._candidates.update(dict.fromkeys(self._table.near(rc)))

    def due(self, now_s: float) -> Turn | None:
        """Return a candidate whose time is now; the others are candidates no more."""
        table = self._table
        self._reserved.clear()  # nothing changes while they are looked at
        while self._candidates:
            arc, _ = self._candidates.popitem()
            if not (arc.state is RequestState.WAITING and table.could_start(arc, now_s) and table.usable(arc)):
                continue
            if self._takes_from_others(arc, now_s):
                continue
            if table.must_let_higher_go_first(arc):
                continue
            others = table.beside(arc)
            if not table.fits(arc, [h for h in others if h.holds and table.stands_until_s(h, arc, now_s) > now_s]):
                continue  # one by one they would let it in, but not together
            in_the_way = table.in_the_way(arc, [], others, now_s)
            if in_the_way or table.fits(arc, [other for other in others if other.holds]):
                return Turn(arc, in_the_way)
        return None

    def _takes_from_others(self, arc: ArcEntry, now_s: float) -> bool:
        """Say whether, if it started now, it would take time from a higher one or from the first in line at an RC."""
        end_s = now_s + arc.length_s - min(self._slack_s, arc.minimum_s / 2) - INSTANT_S

        crowd = [holder for holder in self._crowd(arc) if self._table.fits(arc, [holder])]

        def from_one(other: ArcEntry) -> bool:
            competes = other is not arc and not self._table.fits(arc, [other, *crowd]) and self._table.usable(other)
            return competes and self._reserved_s(other, now_s, (arc,)) < end_s

        firsts = dict.fromkeys(self.at(rc) for rc in arc.uses)
        if any(from_one(first) for first in firsts if first is not None):
            return True
        return any(from_one(one) for one in self._table.beside(arc) if one.queued and higher(one.path, arc.path))

    def _crowd(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return those that hold a sharable RC of the ARC."""
        return [
            *dict.fromkeys(holder for rc in arc.shares for holder in self._table.rcs[rc].holders if holder is not arc)
        ]

    def at(self, rc: str) -> ArcEntry | None:
        """Return the first in order of those queued for the RC; None if nobody is."""
        if rc not in self._firsts:
            queued = [user for user in self._table.users(rc) if user.queued and self._table.usable(user)]
            self._firsts[rc] = self._table.in_order(queued)[0] if queued else None
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
        holders = dict.fromkeys(holder for rc in arc.uses for holder in self._table.rcs[rc].holders)
        ends = [
            self._table.stands_until_s(h, arc, now_s)
            for h in holders
            if h is not arc and not self._table.fits(arc, [h])
        ]
        start_s = max([now_s, *ends])
        if len(behind) > LOOK_AHEAD:
            return start_s
        for rc in arc.uses if start_s < math.inf else ():
            first = self.at(rc)
            if first is None or first is arc or first in behind or self._table.fits(arc, [first]):
                continue
            first_s = self._reserved_s(first, now_s, (*behind, arc))
            if first_s < start_s + arc.length_s - INSTANT_S:
                start_s = math.inf if higher(first.path, arc.path) else max(start_s, first_s + first.length_s)
        self._reserved[arc] = start_s
        return start_s

    def estimate(self, order: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return where these will be, given in order, if at each RC one turn after the other is taken.

        What sharers of an RC take of its time is counted by what they send, not stream by stream.
        """
        ends_s: dict[str, float] = {}
        taken_s: dict[str, float] = {}
        exclusive: dict[str, Above] = {rc: Above() for arc in order for rc in arc.uses}
        sharers: dict[str, Above] = {rc: Above() for arc in order for rc in arc.shares}
        slots = []
        for arc in order:
            if not self._table.usable(arc):
                slots.append(Slot(arc, math.inf, self._standing(arc, now_s)))
                continue
            crowded = [rc for rc in arc.shares if not self._table.has_room_for_all(rc)]
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
        return min(
            1.0, sum(one.packet_time_s / one.period_s for one in arc.uses[rc].streams) / self._table.rcs[rc].capacity
        )

    def _standing(self, arc: ArcEntry, now_s: float) -> list[Hold]:
        """Return the holders that the ARC cannot run beside."""
        return [
            (holder, -math.inf, self._table.stands_until_s(holder, arc, now_s))
            for holder in dict.fromkeys(holder for rc in arc.uses for holder in self._table.rcs[rc].holders)
            if holder is not arc and not self._table.fits(arc, [holder])
        ]
