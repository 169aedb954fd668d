"""Large group: in a group too large to be planned whole, each RC is reserved only for the first ARC in line.

This is backfilling with a reservation for the first in line (see ``planner``), here at each RC. An ARC starts if its
slice ends before the reserved starts, and may overtake ARCs further back. A decision examines the ARC's own RCs instead
of the whole group.

Source: decision 0011.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.estimate import estimate, starts_s
from backbone.scheduling.first_in_line import FirstInLine
from backbone.scheduling.planner import Slot, Turn
from backbone.scheduling.preemption import in_the_way, must_let_higher_go_first
from backbone.scheduling.priority import higher
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table


class _Blocked(NamedTuple):
    """Until when a holder keeps an ARC from starting.

    Attributes:
        rc: An RC of both; every change of either is a change of it.
        version: Version of that RC, and of the RCs' service, at that time.
        until_s: End of the holder's slice; infinite: the holder changes before.
    """

    rc: str
    version: int
    until_s: float


class LargeGroupPlanner:
    """Plans one ARC after the other, each beside the ARCs that use the same RCs."""

    is_exact = False
    reserves = False

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with no candidates.

        Args:
            slack_s: Longest overlap of two reservations.
        """
        self._table = table
        self._state = table.state
        self._firsts = FirstInLine(table, slack_s=slack_s)
        self._by_time = table.state.fairness.discipline == "time"
        self._near: dict[str, Sequence[ArcEntry]] = {}
        self._candidates: dict[ArcEntry, None] = {}
        self._blocked: dict[ArcEntry, _Blocked] = {}

    def look_near(self, rc: str, joined: Sequence[ArcEntry]) -> None:
        """Examine, in the next decision, the ARCs that a change of this RC concerns."""
        self._near[rc] = joined

    def due(self, now_s: float) -> Turn | None:
        """Return a turn whose time is now, of the most senior candidate; after None there are no candidates."""
        table = self._table
        for arc in self._possible(now_s):
            if self._firsts.takes_from_others(arc, now_s):
                continue
            holders = [*table.holders(arc)]
            staying = [one for one in holders if table.stands_until_s(one, arc, now_s) > now_s + INSTANT_S]
            if not table.fits(arc, staying):
                continue  # each holder alone leaves it room, but all together do not
            if must_let_higher_go_first(table, arc):
                continue
            displaced = in_the_way(table, arc, [], holders, now_s)
            turn = Turn(arc, displaced)
            if not table.fits(arc, holders) if not displaced else self._by_time and table.runs_on(turn):
                continue
            return turn
        return None

    def _possible(self, now_s: float) -> Iterator[ArcEntry]:
        """Remove the candidates, most senior first; yield those that no single holder keeps from starting now.

        Behind a higher first in line, no reservation but this order keeps one of them from taking every gap.
        """
        self._examine()
        table, state, blocked, soon_s = self._table, self._state, self._blocked, now_s + INSTANT_S
        if len(blocked) > 2 * len(state.arcs):
            blocked.clear()  # it may hold ARCs that left
        versions, service_version = state.rc_versions, state.service_version
        left: list[ArcEntry] = []
        for arc in self._candidates:
            if arc.state is not RequestState.WAITING:
                continue
            known = blocked.get(arc)
            if (
                known is not None
                and soon_s < known.until_s
                and known.version == versions.get(known.rc, 0) + service_version
            ):
                continue
            left.append(arc)
        seniority = state.fairness.seniority
        left.sort(key=lambda arc: seniority(arc, now_s))
        self._candidates = dict.fromkeys(left)
        for arc in left:
            del self._candidates[arc]
            blocker = table.blocker(arc, table.holders(arc), now_s)
            if blocker is not None:
                ends = blocker.state is RequestState.RUNNING and not blocker.goes_before(arc)
                rc = next(rc for rc in arc.uses if rc in blocker.uses)
                version = versions.get(rc, 0) + service_version
                blocked[arc] = _Blocked(rc, version, blocker.end_s if ends else math.inf)
            elif table.usable(arc):
                yield arc

    def _examine(self) -> None:
        """Make those ARCs candidates again that are concerned by changes since the last examination.

        These are the users of an RC, and ARCs that may wait for one of its users at another RC.
        """
        users, bits, held_alone = self._state.users, self._state.bits, self._state.held_alone
        waiting, candidates = RequestState.WAITING, self._candidates
        firsts: dict[str, ArcEntry | None] = {}
        elsewhere, settled = list[str](), held_alone  # where an RC is held alone, the holder's slice is not over
        for rc, joined in self._near.items():
            if joined and self._firsts.is_first_without(rc, joined):
                candidates.update(dict.fromkeys(joined))  # no other may start because these wait, too
                continue
            for arc in users.get(rc, ()):
                if arc.state is waiting:
                    candidates[arc] = None
                if not arc.queued or not arc.touches & ~settled:
                    continue
                for other in arc.uses:
                    if settled & bits[other]:
                        continue
                    if other not in firsts:
                        firsts[other] = self._firsts.at(other)
                    first = firsts[other]
                    if first is None or first is arc or first.level is not arc.level:
                        elsewhere.append(other)  # an ARC may wait there only because this one is first in line
                        settled |= bits[other]
        for rc in elsewhere:
            free = [arc for arc in users[rc] if arc.state is waiting and not arc.touches & held_alone]
            candidates.update(dict.fromkeys(free))
        self._near.clear()

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
        """Return an estimate of when the RCs of a queued ARC will begin to settle; infinite behind a higher one."""
        others = [one for rc in arc.uses for one in self._state.users[rc] if one.queued and one.level is not arc.level]
        alone = [one for one in others if arc.touches & one.excludes or arc.excludes & one.touches]
        if any(one.goes_before(arc) and self._table.usable(one) for one in alone):
            return math.inf  # as ``estimate`` finds, too, but only after it has put all in order
        return starts_s(self._table, [*self.before(arc), arc], now_s)[-1]

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
        firsts = dict.fromkeys(self._firsts.at(rc) for rc in arc.uses)
        return [first for first in firsts if first is not None and first is not arc]
