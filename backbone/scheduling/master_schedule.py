"""Master schedule: the table of RCs and ARCs, and the plan for them: who may run when.

Nothing here changes who holds what; the schedule manager does. Here is the *plan*: at a time, go
through the waiting ARCs in order and give each the earliest start at which it fits for its whole
settling and minimum run time, without taking anything from those before it.

A decision looks only at groups in which something has happened since the last one. A group of up to
``exact_up_to`` ARCs is planned whole (``plan``), a bigger one beside each RC (``first_in_line``).

Rules of this file (numbers as in docs and ``why``):

* 3  Plan: earliest start at which an ARC fits whole; a later start is reserved.
* 4  Holders that are lower, or equal and served, go for whom it is time.
* 7  What happens in one group changes no time in another.
* 8  Under ``strict`` nobody starts while a higher usable one of its group waits.

Source: IROS 2001, "RC manager"; RAM 2002, "The RC Scheduler", last paragraphs.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Sequence

from backbone.scheduling.entries import CONNECTED, ArcEntry
from backbone.scheduling.estimate import estimate
from backbone.scheduling.fairness import Discipline
from backbone.scheduling.first_in_line import FirstInLine
from backbone.scheduling.groups import Group
from backbone.scheduling.plan import Plan, Slot, Turn
from backbone.scheduling.priority import by_precedence, higher
from backbone.scheduling.requests import RequestState
from backbone.scheduling.response_time import Analysis
from backbone.scheduling.table import EXACT_UP_TO, Table


class MasterSchedule(Table):
    """The table, and the plan for it."""

    def __init__(
        self,
        *,
        tolerance_s: float,
        strict: bool,
        discipline: Discipline = "turns",
        admission: Analysis = "exact",
        exact_up_to: int = EXACT_UP_TO,
    ) -> None:
        """Begin empty.

        Args:
            tolerance_s: By how much two reservations may overlap. Hand-over takes time: without it an
                ARC never fits a gap that is exactly as long as its slice.
            strict: See ``Table``.
            discipline: See ``Table``.
            admission: See ``Table``.
            exact_up_to: See ``Table``.
        """
        super().__init__(
            tolerance_s=tolerance_s,
            strict=strict,
            discipline=discipline,
            admission=admission,
            exact_up_to=exact_up_to,
        )
        self._line = FirstInLine(self, slack_s=tolerance_s)
        self._plans: dict[Group[ArcEntry], _Plans] = {}

    # What changed since the last decision.

    def touch(self, arc: ArcEntry) -> None:
        """Have all who use an RC of the ARC looked at again; see ``Table.touch``."""
        super().touch(arc)
        self._line.forget(arc.uses)
        self._plans.clear()

    def rc_changed(self, rc: str) -> None:
        """Have all who use the RC looked at again; see ``Table.rc_changed``."""
        super().rc_changed(rc)
        self._line.forget([*self.rcs])
        self._plans.clear()

    def priorities_changed(self) -> None:
        """Have everybody looked at again; see ``Table.priorities_changed``."""
        super().priorities_changed()
        self._line.forget([*self.rcs])
        self._plans.clear()

    def next_end_s(self, now_s: float) -> float | None:
        """Return when the next slice ends that somebody waits for; see ``Table.next_end_s``."""
        self._plans.clear()
        return super().next_end_s(now_s)

    # Whose time has come (rules 3, 4, 8).

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now, and who must go for it; None if nobody's is.

        Looks where something changed since nobody's time was; asked again after the turn was carried out.
        """
        while self._touched:
            rc = next(iter(self._touched))
            users = self.users(rc)
            group = self._groups.of(next(iter(users))) if users else None
            if group is None:
                del self._touched[rc]
            elif len(group) > self._exact_up_to:
                del self._touched[rc]
                self._line.look_near(rc)
            else:
                turn = self._due_in(group, now_s)
                if turn is not None:
                    return turn
                for looked_at in {used for arc in group.arcs for used in arc.uses}:
                    self._touched.pop(looked_at, None)
        return self._line.due(now_s)

    def forgotten(self, now_s: float) -> ArcEntry | None:
        """Return an ARC whose time is now in a group that is planned whole, wherever that is; for checks.

        Where RCs are freed late, plans change as time passes; such a group is looked at when they are.
        """
        self._plans.clear()
        for group in {self._groups.of(arc): None for arc in self.arcs.values() if arc.active}:
            if len(group) > self._exact_up_to or any(self.is_overdue(arc, now_s) for arc in group.arcs):
                continue
            turn = self._due_in(group, now_s)
            if turn is not None:
                return turn.arc
        return None

    def _due_in(self, group: Group[ArcEntry], now_s: float) -> Turn | None:
        """Return whose time is now in a group that is planned whole."""
        holders = [arc for arc in group.arcs if arc.holds]
        waiting = (arc for arc in group.arcs if arc.state is RequestState.WAITING)
        possible = {arc for arc in waiting if self.could_start(arc, holders, now_s)}
        if not possible:
            return None
        plans = self._plans_of(group, now_s)
        last = max(place for place, arc in enumerate(plans.order) if arc in possible)
        queued = plans.order[: last + 1]  # who comes after them changes nothing for them
        if self.discipline == "turns":
            return self._due_of(queued, possible, plans, now_s)
        while queued:
            by_time = _Plans(self, queued, group.arcs, now_s, slack_s=self._tolerance_s, among_equals=False)
            turn = self._due_of(queued, possible, by_time, now_s)
            if turn is None or self._in_turn(turn, group, now_s):
                return turn
            queued.remove(turn.arc)
        return None

    def _plans_of(self, group: Group[ArcEntry], now_s: float) -> _Plans:
        plans = self._plans.get(group)
        if plans is None:
            order = self.in_order([arc for arc in group.arcs if arc.queued])
            plans = self._plans[group] = _Plans(self, order, group.arcs, now_s, slack_s=self._tolerance_s)
        return plans

    def _due_of(
        self, queued: Sequence[ArcEntry], possible: Collection[ArcEntry], plans: _Plans, now_s: float
    ) -> Turn | None:
        """Return whose time is now of these, given in order.

        A slice is ended only for who fits without forgiveness, however early the hand-overs under way may
        end: else it might be ended for a gap that closes meanwhile.
        """
        now = plans.now
        if not any(now.starts_now(arc) for arc in queued if arc in possible):
            return None
        before: list[ArcEntry] = []
        for arc in queued:
            if arc.state is not RequestState.WAITING or self.must_let_higher_go_first(arc):
                continue
            if arc in possible and (
                now.starts_now(arc) or (plans.exact.starts_now(arc) and plans.certain.starts_now(arc))
            ):
                pending = [other for other in before if plans.certain.starts_now(other)]
                in_the_way = self.in_the_way(arc, pending, plans.group, now_s)
                if in_the_way and plans.certain.starts_now(arc):
                    return Turn(arc, in_the_way)
                if not in_the_way and now.starts_now(arc) and self.fits(arc, [h for h in plans.group if h.holds]):
                    return Turn(arc, [])
            before.append(arc)
        return None

    def _in_turn(self, turn: Turn, group: Group[ArcEntry], now_s: float) -> bool:
        """Say whether somebody would displace each that must go for this turn also if equals took turns.

        RCs come free as whole sets: who had least time, but would not get all its RCs so, ends no slice.
        """
        order = by_precedence([arc for arc in group.arcs if arc.queued], lambda arc: arc.path, lambda arc: arc.stamp)
        plan = Plan(self, order, group.arcs, now_s, slack_s=0.0, handed_over=True)
        entitled = [arc for arc in order if plan.starts_now(arc)]
        holders = [holder for holder in group.arcs if holder.state in CONNECTED]
        return all(
            any(arc.touches & holder.touches and not self.fits(arc, holders) for arc in entitled)
            for holder in turn.in_the_way
        )

    def needs_reservation(self, arc: ArcEntry) -> bool:
        """Say whether only a reservation keeps equals from what is being freed for the ARC."""
        return self.discipline == "time" or not self.planned_whole(arc)

    # Views: who waits before whom, and when an ARC will start.

    def plan(
        self, group: Sequence[ArcEntry], now_s: float, *, handed_over: bool = False, slack_s: float | None = None
    ) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order.

        Args:
            group: Active ARCs.
            now_s: From when on.
            handed_over: Plan as if all RCs that are being freed were free already.
            slack_s: By how much an ARC may overlap those before it, but not by more than half its slice;
                None: by the tolerance of this run.
        """
        order = self.in_order([arc for arc in group if arc.queued])
        slack_s = self._tolerance_s if slack_s is None else slack_s
        return Plan(self, order, group, now_s, slack_s=slack_s, handed_over=handed_over).slots()

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of a group, in order; of a big group an estimate."""
        if len(group) <= self._exact_up_to:
            return self.plan(group, now_s)
        return estimate(self, self.in_order([arc for arc in group if arc.queued]), now_s)

    def slot_of(self, arc: ArcEntry, now_s: float) -> Slot | None:
        """Return the place of the ARC in the plan; None if it is not queued."""
        if not arc.queued:
            return None
        if not self.planned_whole(arc):
            return estimate(self, [*self.before(arc), arc], now_s)[-1]
        return next(slot for slot in self.plan(self.group_of(arc), now_s) if slot.arc is arc)

    def start_s(self, arc: ArcEntry, now_s: float) -> float:
        """Return when the RCs of a queued ARC will begin to settle, as the decision being made sees it."""
        if not self.planned_whole(arc):
            return estimate(self, [*self.before(arc), arc], now_s)[-1].start_s
        return self._plans_of(self._groups.of(arc), now_s).now.start_s(arc)

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs that come before a queued one, in order.

        In a group too big to be planned whole: at one of its RCs; under ``strict`` also higher ones anywhere.
        """
        group = self._groups.of(arc).arcs
        if self.planned_whole(arc):
            order = self.in_order([other for other in group if other.queued])
            return order[: order.index(arc)]
        before: dict[ArcEntry, None] = {}
        for rc in arc.uses:
            order = self.in_order([user for user in self.users(rc) if user.queued])
            before.update(dict.fromkeys(order[: order.index(arc)]))
        if self.strict:
            before.update((other, None) for other in group if other.queued and higher(other.path, arc.path))
        return self.in_order([*before])

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return who is first in line at an RC of the ARC and is not the ARC itself."""
        firsts = dict.fromkeys(self._line.at(rc) for rc in arc.uses)
        return [first for first in firsts if first is not None and first is not arc]


class _Plans:
    """The plans a decision about one group looks at, each made when it is first needed."""

    def __init__(
        self,
        table: Table,
        order: list[ArcEntry],
        group: Iterable[ArcEntry],
        now_s: float,
        *,
        slack_s: float,
        among_equals: bool = True,
    ) -> None:
        self.order = order
        self.group = [*group]
        self._make = functools.partial(Plan, table, order, self.group, now_s, among_equals=among_equals)
        self._slack_s = slack_s

    @functools.cached_property
    def now(self) -> Plan:
        """The plan as things are, with the tolerance of this run."""
        return self._make(slack_s=self._slack_s)

    @functools.cached_property
    def exact(self) -> Plan:
        """The plan in which nobody overlaps anybody."""
        return self._make(slack_s=0.0)

    @functools.cached_property
    def certain(self) -> Plan:
        """The same, as if all that is being freed were free already."""
        if not any(arc.state is RequestState.REVOKING for arc in self.group):
            return self.exact
        return self._make(slack_s=0.0, handed_over=True)
