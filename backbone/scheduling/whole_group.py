"""Whole group: each queued ARC of a group has a reserved start, so that backfilling never delays it (rule 3).

This is conservative backfilling (see ``planner``), with priorities and with sets of RCs instead of one number of
processors. It costs a plan of the whole group after every change in it.

Rules of this file (numbers as in docs and ``why``):

* 3  Plan: earliest start at which an ARC fits whole; a later start is reserved.
* 4  Lower holders, and served equal ones, are revoked for the ARC whose time has come.
* 8  Under ``strict`` no ARC starts while a higher usable one of its group waits.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Iterable, Sequence

from backbone.scheduling.entries import CONNECTED, INSTANT_S, ArcEntry
from backbone.scheduling.groups import Group
from backbone.scheduling.plan import GroupPlans, Plan
from backbone.scheduling.planner import Slot, Turn, in_order_of_revocation
from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.preemption import must_let_higher_go_first
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table


class WholeGroupPlanner:
    """Plans each group whole."""

    is_exact = True
    reserves: bool
    """Under the discipline ``time`` a later start does not bind equals."""

    def __init__(self, table: Table, *, slack_s: float) -> None:
        """Begin with no groups to examine.

        Args:
            slack_s: Longest overlap of two reservations. Hand-over takes time, so without slack an ARC never fits a
                gap that is exactly as long as its slice.
        """
        self._table = table
        self._state = table.state
        self._slack_s = slack_s
        self.reserves = table.state.fairness.discipline == "turns"
        self._near: dict[str, None] = {}
        self._plans: dict[Group[ArcEntry], GroupPlans] = {}
        self._planned = -1

    def look_near(self, rc: str, joined: Sequence[ArcEntry]) -> None:
        """Examine, in the next decision, the group that uses the RC."""
        del joined
        self._near[rc] = None

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now, and the holders to revoke for it; None if no examined group has one."""
        self._forget_outdated()
        while self._near:
            rc = next(iter(self._near))
            users = self._state.users.get(rc, ())
            if not users:
                del self._near[rc]
                continue
            group = self._state.groups.of[next(iter(users))]
            turn = self._due_in(group, now_s)
            if turn is not None:
                return turn
            for looked_at in {used for arc in group.arcs for used in arc.uses}:
                self._near.pop(looked_at, None)
        return None

    def forgotten(self, group: Sequence[ArcEntry], now_s: float) -> ArcEntry | None:
        """Return an ARC of the group whose time is now.

        If RCs are freed late, or an ARC runs on beyond its slice under the discipline ``time``, plans change as time
        passes. Such a group is examined when the RCs are free, or when that ARC's next check is due.
        """
        runs_on = not self.reserves and any(arc.served(now_s) for arc in group)
        if runs_on or any(self._table.is_overdue(arc, now_s) for arc in group):
            return None
        self._plans.clear()
        turn = self._due_in(self._state.groups.of[group[0]], now_s)
        return turn.arc if turn is not None else None

    def _due_in(self, group: Group[ArcEntry], now_s: float) -> Turn | None:
        order, possible = self._table.line(group.arcs, now_s, self._in_order)
        if not possible:
            return None
        plans = self._plans[group] = GroupPlans(self._table, order, group.arcs, now_s, slack_s=self._slack_s)
        last = max(place for place, arc in enumerate(order) if arc in possible)
        queued = order[: last + 1]  # later ARCs do not affect these
        if self.reserves:
            turn = plans.due(queued, possible)
            return turn or (self._beside_held_back(group, queued, possible, now_s) if self._table.strict else None)
        while queued:
            by_time = GroupPlans(self._table, queued, group.arcs, now_s, slack_s=self._slack_s, among_equals=False)
            turn = by_time.due(queued, possible)
            if turn is None:
                break
            if self._in_turn(turn, group, now_s) and not self._table.runs_on(turn):
                return turn
            queued.remove(turn.arc)
        in_turns = GroupPlans(self._table, _in_turns(group.arcs, now_s), group.arcs, now_s, slack_s=self._slack_s)
        queued = in_turns.order[:]
        while (turn := in_turns.due(queued, possible)) is not None:
            if all(turn.arc.goes_before(holder) for holder in turn.in_the_way):
                return turn  # it harms no equal: it starts in a gap, or preempts lower ARCs
            queued.remove(turn.arc)
        return None

    def _forget_outdated(self) -> None:
        if self._planned != self._state.version:
            self._plans.clear()
            self._planned = self._state.version

    def _in_turn(self, turn: Turn, group: Group[ArcEntry], now_s: float) -> bool:
        """Return whether the turn would also be right if equals took turns.

        RCs become free as whole sets. If the ARC with the least time would not get all its RCs by a turn, it ends no
        slice. Nor does it start in a gap that higher ARCs will need.
        """
        order = _in_turns(group.arcs, now_s)
        plan = functools.partial(Plan, self._table, now_s=now_s, slack_s=0.0, handed_over=True)
        if plan(order, group=group.arcs).start_s(turn.arc) == math.inf:
            return False
        if self._delays(turn.arc, [arc for arc in order if arc.goes_before(turn.arc)], order, group, now_s):
            return False
        rest, ended = [*group.arcs], set[ArcEntry]()
        for holder in in_order_of_revocation(turn):
            keepers = [arc for arc in rest if arc.state in CONNECTED]
            now = plan(_in_turns(group.arcs, now_s, ended), group=rest)
            due = [arc for arc in order if arc.state is RequestState.WAITING and now.starts_now(arc)]
            rivals = [arc for arc in due if arc.touches & holder.touches and _may_displace(arc, holder, now_s)]
            entitled = [arc for arc in rivals if self._needs_more(arc, keepers, due)]
            if not (entitled if holder.served(now_s) else turn.arc in entitled[:1]):  # preempted for the first of them
                return False
            rest.remove(holder)
            ended.add(holder)
        return True

    def _beside_held_back(
        self, group: Group[ArcEntry], order: list[ArcEntry], possible: Collection[ArcEntry], now_s: float
    ) -> Turn | None:
        """Return an ARC that starts in a gap which only ARCs that the policy holds back would fill.

        What holds them back may last for ever, and the RCs would stay free as long.
        """
        free = [arc for arc in order if not must_let_higher_go_first(self._table, arc)]
        if len(free) == len(order):
            return None
        now = Plan(self._table, free, group.arcs, now_s, slack_s=0.0)
        holders = [holder for holder in group.arcs if holder.holds]
        for place, arc in enumerate(free):
            if arc in possible and now.starts_now(arc) and self._table.fits(arc, holders):
                before = [other for other in free[:place] if not arc.goes_before(other)]
                if not self._delays(arc, before, order, group, now_s):
                    return Turn(arc, [])
        return None

    def _delays(
        self, arc: ArcEntry, others: Sequence[ArcEntry], order: Sequence[ArcEntry], group: Group[ArcEntry], now_s: float
    ) -> bool:
        """Return whether a start now would delay one of these that wait."""
        waiting = [other for other in others if other.state is RequestState.WAITING]
        if not waiting:
            return False
        without = Plan(self._table, order, group.arcs, now_s, slack_s=self._slack_s)
        first = [arc, *(other for other in order if other is not arc)]
        after = Plan(self._table, first, group.arcs, now_s, slack_s=self._slack_s)
        return any(after.start_s(other) > without.start_s(other) + INSTANT_S for other in waiting)

    def _needs_more(self, arc: ArcEntry, keepers: Sequence[ArcEntry], due: Sequence[ArcEntry]) -> bool:
        """Return whether the ARC does not fit together with the holders, or not with the holders and other due ARCs."""
        others = [other for other in due if other is not arc]
        return not (self._table.fits(arc, keepers) and self._table.fits(arc, [*keepers, *others]))

    # Views: which ARCs wait before which, and when an ARC will start.

    def plan(
        self, group: Iterable[ArcEntry], now_s: float, *, handed_over: bool = False, slack_s: float | None = None
    ) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order.

        Args:
            group: Active ARCs; all of a group, or a hypothetical part of it.
            now_s: Earliest time.
            handed_over: True: plan as if all RCs that are being freed were free already.
            slack_s: Longest overlap of an ARC with those before it, but at most half its slice; None: the tolerance of
                this run.
        """
        arcs = [*group]
        slack_s = self._slack_s if slack_s is None else slack_s
        order = self._in_order(arcs)
        return Plan(self._table, order, arcs, now_s, slack_s=slack_s, handed_over=handed_over).slots()

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order."""
        return self.plan(group, now_s)

    def slots_around(self, arc: ArcEntry, now_s: float) -> list[Slot]:
        """Return the places of all queued ARCs of its group, in order."""
        return self.plan(self._state.group_of(arc), now_s)

    def start_s(self, arc: ArcEntry, now_s: float) -> float:
        """Return when the RCs of a queued ARC will begin to settle, as of the present decision."""
        self._forget_outdated()
        group = self._state.groups.of[arc]
        if group not in self._plans:
            order = self._in_order(group.arcs)
            self._plans[group] = GroupPlans(self._table, order, group.arcs, now_s, slack_s=self._slack_s)
        return self._plans[group].now.start_s(arc)

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs of its group that come before a queued one, in order."""
        order = self._in_order(self._state.group_of(arc))
        return order[: order.index(arc)]

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return none: every queued ARC has a reserved start."""
        del arc
        return []

    def _in_order(self, arcs: Iterable[ArcEntry]) -> list[ArcEntry]:
        """Return what ``order`` does, which a planner of one's own may get wrong: then no plan would ever end."""
        arcs = [*arcs]
        order = self.order(arcs)
        queued = {arc for arc in arcs if arc.queued}
        if not isinstance(order, list):
            raise TypeError(f"{type(self).__name__}.order returned {order!r}, not the list of the queued ARCs")
        if len(order) != len(queued) or {*order} != queued:
            told = ", ".join(arc.name for arc in order) or "nothing"
            raise AssertionError(f"the planner's order is {told}, not each queued ARC once")
        return order

    def order(self, arcs: Iterable[ArcEntry]) -> list[ArcEntry]:
        """Return the queued ARCs among ARCs of one group, the first in line first (rule 2)."""
        return self._table.in_order([arc for arc in arcs if arc.queued])


def _may_displace(arc: ArcEntry, holder: ArcEntry, now_s: float) -> bool:
    return arc.goes_before(holder) or (holder.served(now_s) and not holder.goes_before(arc))


def _in_turns(group: Iterable[ArcEntry], now_s: float, ended: Collection[ArcEntry] = ()) -> list[ArcEntry]:
    """Return the queued ARCs in the order that they would have if equals took turns.

    Args:
        group: Active ARCs.
        now_s: Present time.
        ended: Holders that count as queued, because they are revoked now.
    """

    def seniority(arc: ArcEntry) -> tuple[float, float]:
        if arc in ended and arc.served(now_s):
            return (now_s, math.inf)
        is_first = arc.reservation is not None and arc.has_forced
        return (-math.inf, arc.reservation or 0) if is_first else arc.stamp

    return by_precedence([arc for arc in group if arc.queued or arc in ended], lambda arc: arc.path, seniority)
