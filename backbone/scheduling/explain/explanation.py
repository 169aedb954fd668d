"""Explanation: the state of the master schedule in sentences, with the deciding rule.

Rule of this file: it reads and never changes. It uses the plan that also decides, so that its predictions come true
if no event comes in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from backbone.naming import component_of
from backbone.scheduling.entries import INSTANT_S, ArcEntry, RcEntry
from backbone.scheduling.explain.blockers import Blockers
from backbone.scheduling.explain.packet_lines import never_served, packet_lines
from backbone.scheduling.explain.start_prediction import Foreseen, StartPrediction
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.planner import Slot
from backbone.scheduling.priority import higher
from backbone.scheduling.requests import LEASE_S, Holder, RequestState, Scheduled, UnknownRequest
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.views import RcView, RequestView, Schedule, Why
from backbone.spoken import counted

UNKNOWN_S = -1.0
MOST_REHEARSED = 32  # chosen: so many are played forward over at least some thirty slices

_REASONS = {
    "slice": "its slice was over and it was the turn of {by}",
    "higher": "{by} is higher and took over",
    "rc": "{by} does not answer",
    "capacity": "{by} can give less than before",
    "order": "{by} could not serve all its holders in time in their new order",
    "packets": "its packets took longer than it had declared",
    "failed": "it could not open its gate",
    "self": "its owner wanted no time any more",
}


class _Answer(NamedTuple):
    """Lines for people, the deciding rule, and the event that would change the state."""

    lines: list[str]
    rule: str
    would_change: str


class Explanation:
    """Answers about one master schedule."""

    def __init__(
        self,
        schedule: MasterSchedule,
        rules: SchedulingRules,
        foresee: Callable[[Collection[ArcEntry], float], Foreseen],
    ) -> None:
        """Explain this schedule.

        Args:
            schedule: The schedule; nothing in it changes.
            rules: Rules of the decisions.
            foresee: Plays the schedule forward until these waiting ARCs are granted; arguments: ARCs, time of the
                question.
        """
        self._foresee = foresee
        self._schedule = schedule
        self._table = schedule.table
        self._state = schedule.state
        self._rules = rules
        self._blockers = Blockers(schedule)
        self._prediction = StartPrediction(schedule, rules)

    # Views.

    def scheduled(self, arc: ArcEntry, now_s: float) -> Scheduled:
        """Return the state of one request."""
        slot, granted_s = self._place(arc, now_s)
        return Scheduled(
            rcs=list(arc.uses),
            state=arc.state,
            position=len(self._schedule.planner_of(arc).before(arc)) + 1 if slot is not None else 0,
            blockers=[other.name for other in self._blockers.direct(slot, now_s)] if slot is not None else [],
            expected_start_s=_expected_s(arc, granted_s),
        )

    def schedule(self, now_s: float) -> Schedule:
        """Return the whole schedule."""
        groups = self._state.in_groups()
        slot_of: dict[ArcEntry, Slot] = {}
        grants_s: dict[ArcEntry, float] = {}
        for group in groups:
            slots = self._schedule.slots(group, now_s)
            slot_of.update((slot.arc, slot) for slot in slots)
            grants_s.update(self._prediction.grants_s(slots, now_s))
        coming: dict[str, list[tuple[ArcEntry, float]]] = {rc: [] for rc in self._state.rcs}
        for arc, granted_s in sorted(grants_s.items(), key=lambda item: item[1]):
            for rc in arc.uses if granted_s < math.inf else ():
                coming[rc].append((arc, granted_s))
        return Schedule(
            at_s=now_s,
            rcs=[self._rc_view(rc, coming[rc.name], now_s) for rc in self._state.rcs.values()],
            requests=[
                self._request_view(arc, slot_of.get(arc), grants_s.get(arc, math.inf), now_s)
                for arc in self._state.arcs.values()
            ],
            groups=[[arc.name for arc in group] for group in groups],
        )

    def _rc_view(self, rc: RcEntry, coming: Sequence[tuple[ArcEntry, float]], now_s: float) -> RcView:
        holders = [*rc.holders]
        return RcView(
            rc=rc.name,
            kind=rc.kind,
            state="up" if rc.up else "down",
            sharable=rc.sharable,
            capacity=rc.capacity,
            holders=[Holder(arc.name, arc.epochs[rc.name], arc.since_s, now_s + LEASE_S) for arc in holders],
            last_epoch=rc.epoch,
            next=[arc.name for arc, _ in coming],
            until_s=[self._until_s(arc) for arc in holders],
            next_s=[granted_s for _, granted_s in coming],
            is_robot=rc.is_robot,
        )

    def _request_view(self, arc: ArcEntry, slot: Slot | None, granted_s: float, now_s: float) -> RequestView:
        blockers = self._blockers.direct(slot, now_s) if slot is not None else []
        answer = self._answer(arc, slot, blockers, granted_s, now_s)
        return RequestView(
            arc=arc.name,
            owner=arc.request.owner,
            state=arc.state,
            rcs=list(arc.uses),
            since_s=arc.since_s,
            until_s=self._until_s(arc),
            expected_start_s=_expected_s(arc, granted_s),
            because=f"{arc.name} {arc.state}: {answer.lines[0]}",
            blockers=[other.name for other in blockers],
            minimum_runtime_s=arc.minimum_s,
            priority="/".join(f"{name}:{number}" for name, number in arc.path),
            turns=arc.turns,
            rule=answer.rule,
            would_change=answer.would_change,
            raised=arc.raised,
        )

    # Why.

    def why(self, name: str, now_s: float) -> Why:
        """Return the reasons for an ARC, an owner or an RC.

        Raises:
            UnknownRequest: No ARC, owner or RC has this name.
        """
        if name in self._state.arcs:
            return self._why_arcs([self._state.arcs[name]], now_s)[0]
        owned = [
            arc for arc in self._state.arcs.values() if name in (arc.request.owner, component_of(arc.request.owner))
        ]
        if owned:
            return self._why_owner(name, owned, now_s)
        if name in self._state.rcs:
            return self._why_rc(self._state.rcs[name], now_s)
        raise UnknownRequest(f"no ARC or owner named {name!r} asks for run time, and no RC has this name", name=name)

    def _why_owner(self, name: str, owned: Sequence[ArcEntry], now_s: float) -> Why:
        """Return the reasons for all its ARCs; state and rule are those of the ARC that waits longest."""
        answers = self._why_arcs(owned, now_s)
        longest = min(owned, key=lambda arc: (arc.state is not RequestState.WAITING, arc.since_s))
        first = answers[owned.index(longest)]
        return Why(
            name=name,
            state=first.state,
            lines=[line for answer in answers for line in answer.lines],
            rule=first.rule,
            blockers=first.blockers,
            expected_start_s=first.expected_start_s,
            would_change=first.would_change,
        )

    def _why_rc(self, rc: RcEntry, now_s: float) -> Why:
        users = [arc for arc in self._state.arcs.values() if rc.name in arc.uses]
        holders = [arc for arc in users if arc.holds]
        groups = [group for group in self._state.in_groups() if any(rc.name in arc.uses for arc in group)]
        slots = [self._schedule.slots(group, now_s) for group in groups]
        planned_s = [item for places in slots for item in self._prediction.grants_s(places, now_s).items()]
        grants_s = self._grants_s({arc: time_s for arc, time_s in planned_s if rc.name in arc.uses}, now_s)
        coming = sorted(grants_s.items(), key=lambda item: item[1])
        lines = [f"{rc.name} is {'up' if rc.up else 'down' if rc.failed else 'not started'}"]
        if rc.fault:
            lines = [f"{rc.name} is put aside: {rc.fault}"]
        lines += [
            f"{arc.name} holds it under epoch {arc.epochs[rc.name]} since {_at(arc.began_s)}: {self._where(arc, now_s)}"
            for arc in holders
        ]
        lines += [
            f"{arc.name} gets it at about {_at(granted_s)}"
            if granted_s < math.inf
            else f"{arc.name} waits for it without a predicted time"
            for arc, granted_s in coming
        ]
        if not holders and not coming:
            lines.append("no ARC asks for it")
        return Why(
            name=rc.name,
            state="held" if holders else "free" if rc.up else "down",
            lines=lines,
            rule="11" if not rc.up else "3",
            blockers=[arc.name for arc in holders],
            expected_start_s=next((granted_s for _, granted_s in coming if granted_s < math.inf), UNKNOWN_S),
            would_change=_what_brings_back(rc) if not rc.up else "an ARC asks for it, releases it or idles",
        )

    def _why_arcs(self, arcs: Sequence[ArcEntry], now_s: float) -> list[Why]:
        places = {arc: self._place(arc, now_s) for arc in arcs}
        grants_s = self._grants_s({arc: granted_s for arc, (_, granted_s) in places.items() if arc.queued}, now_s)
        return [self._why_arc(arc, slot, grants_s.get(arc, math.inf), now_s) for arc, (slot, _) in places.items()]

    def _grants_s(self, planned_s: Mapping[ArcEntry, float], now_s: float) -> Mapping[ArcEntry, float]:
        """Return the grants of queued ARCs as foreseen; beyond that, or of many ARCs, as planned."""
        if not planned_s or len(self._state.arcs) > MOST_REHEARSED:
            return planned_s
        return self._foresee(planned_s.keys(), now_s).or_planned(planned_s)

    def _why_arc(self, arc: ArcEntry, slot: Slot | None, granted_s: float, now_s: float) -> Why:
        blockers = self._blockers.direct(slot, now_s) if slot is not None else []
        answer = self._answer(arc, slot, blockers, granted_s, now_s)
        lines, would_change = [*answer.lines], answer.would_change
        lines += [self._stands(other, arc, now_s) for other in blockers]
        if arc.state is RequestState.WAITING:
            blockers = self._blockers.altogether(arc, now_s, grace_s=self._rules.grace_s)
            would_change = self._would_let_it_start(arc, blockers, answer.would_change)
        if arc.swapped_out and arc.state is RequestState.WAITING:
            lines.append(f"it lost its RCs last because {_reason(arc)}")
        lines += packet_lines(arc)
        if arc.raised:
            lines.append(
                f"it rose by {counted(arc.raised, 'level')} because it waits long; it comes down again once served"
            )
        return Why(
            name=arc.name,
            state=arc.state,
            lines=[f"{arc.name} {arc.state}: {lines[0]}", *lines[1:]],
            rule=answer.rule,
            blockers=[other.name for other in blockers],
            expected_start_s=_expected_s(arc, granted_s),
            would_change=would_change,
        )

    def _answer(
        self, arc: ArcEntry, slot: Slot | None, blockers: Sequence[ArcEntry], granted_s: float, now_s: float
    ) -> _Answer:
        match arc.state:
            case RequestState.WAITING:
                return self._waits(arc, slot, blockers, granted_s, now_s)
            case RequestState.RUNNING:
                return self._runs(arc, now_s)
            case RequestState.CONNECTING:
                settled_s = arc.began_s + arc.settle_s
                due = "settled at" if settled_s >= now_s - INSTANT_S else "overdue since"
                what = f"its RCs are being connected since {_at(arc.began_s)}, {due} {_at(settled_s)}"
                return _Answer([what], "6", "its RCs settle, or a higher ARC asks")
            case RequestState.REVOKING:
                what = f"its RCs are being disconnected since {_at(arc.since_s)}: {_reason(arc)}"
                return _Answer([what], "6", "its RCs are free")
            case RequestState.IDLE if arc.retry_s is not None:
                return _Answer([f"{arc.retry_why}; again at {_at(arc.retry_s)}"], "6", "that time comes")
            case RequestState.IDLE:
                return _Answer([f"it wants no time since {_at(arc.since_s)}"], "14", "its owner wants time again")

    def _waits(
        self, arc: ArcEntry, slot: Slot | None, blockers: Sequence[ArcEntry], granted_s: float, now_s: float
    ) -> _Answer:
        age = f"since {_at(arc.since_s)} ({now_s - arc.since_s:.1f} s)"
        down = [rc for rc in arc.uses if not self._state.rcs[rc].up]
        if down:
            faults = [f"{rc} is put aside: {self._state.rcs[rc].fault}" for rc in down if self._state.rcs[rc].fault]
            reason = "; ".join([f"{age} for {', '.join(down)}, not up", *faults])
            return _Answer([reason], "11", f"{', '.join(down)} answers")
        if slot is None or not self._table.usable(arc):
            what, until = never_served(arc, self._state)
            return _Answer([f"{age}: {what}"], "11", until)
        if not blockers:
            return _Answer([f"{age}; it is next, its RCs are coming free"], "6", "its RCs are free")
        whom = _names(blockers)
        if self._blockers.held_back_by(arc):
            what = f"{age}: none starts while {whom}, higher in its group, waits (policy strict)"
            return _Answer([what], "8", f"{whom} starts or idles")
        if granted_s == math.inf:
            return self._starves(arc, blockers, f"{age} for {whom}, without a predicted start")
        if not self._schedule.planner_of(arc).is_exact and all(other.queued for other in blockers):
            what = f"{age}; first in line before it: {whom}; granted at about {_at(granted_s)}"
            return _Answer([what], "15", f"{_release(blockers)} earlier, or a higher ARC asks")
        what = f"{age} for {whom}, granted at about {_at(granted_s)}"
        return _Answer([what], "3", f"{_release(blockers)} earlier, or a higher ARC asks")

    def _starves(self, arc: ArcEntry, blockers: Sequence[ArcEntry], what: str) -> _Answer:
        lasting = (RequestState.CONNECTING, RequestState.RUNNING)
        stay = [other for other in blockers if other.state in lasting and higher(other.path, arc.path)]
        place = arc.place_in_tree
        rises = self._rules.aging_s and not any(place[: len(o.place_in_tree)] == o.place_in_tree for o in stay)
        risen = f", unless {arc.name} rises meanwhile (aging)" if rises else ""
        if not stay:
            remedy = f"{_release(blockers)}, or a shorter minimum run time"
            return _Answer([f"{what}: no gap is long enough for it{risen}"], "9", remedy)
        until = "stays until it releases or idles" if len(stay) == 1 else "stay until they release or idle"
        return _Answer([f"{what}: {_names(stay)}, higher, {until}{risen}"], "9", _release(blockers))

    def _would_let_it_start(self, arc: ArcEntry, blockers: Sequence[ArcEntry], otherwise: str) -> str:
        """Return the events after which the ARC would start after one hand-over."""
        needs = [f"{rc} answers" for rc in arc.uses if not self._state.rcs[rc].up]
        if not needs and not self._table.usable(arc):
            needs = [otherwise]
        if blockers:
            needs.append(_release(blockers))
        return ", and ".join(needs) or otherwise

    def _runs(self, arc: ArcEntry, now_s: float) -> _Answer:
        if arc.served(now_s):
            what = f"since {_at(arc.granted_s)}; its slice is over, and no waiting ARC is entitled to its RCs"
            return _Answer([what], "5", "an equal or higher ARC asks for its RCs")
        what = f"since {_at(arc.granted_s)}, its slice ends at {_at(arc.end_s)}"
        return _Answer([what], "3", f"at {_at(arc.end_s)} an equal may take over; a higher ARC at once")

    def _stands(self, other: ArcEntry, arc: ArcEntry, now_s: float) -> str:
        if higher(other.path, arc.path):
            rank = "higher"
        elif higher(arc.path, other.path):
            rank = "lower"
        else:
            rank = "equal"
        shared = ", ".join(rc for rc in arc.uses if rc in other.uses)
        sharing = f"shares {shared}" if shared else "in its group"
        return f"{other.name} ({rank}, {sharing}) {self._where(other, now_s)}"

    def _where(self, arc: ArcEntry, now_s: float) -> str:
        match arc.state:
            case RequestState.RUNNING:
                over = "was over" if arc.served(now_s) else "ends"
                return f"runs, its slice {over} at {_at(arc.end_s)}"
            case RequestState.CONNECTING:
                return f"is being connected since {_at(arc.began_s)}"
            case RequestState.REVOKING:
                return f"is being disconnected since {_at(arc.since_s)}"
            case RequestState.WAITING:
                return "waits before it"
            case RequestState.IDLE:
                return "wants no time"

    def _place(self, arc: ArcEntry, now_s: float) -> tuple[Slot | None, float]:
        """Return the place of the ARC in the plan, if it is queued, and its predicted grant."""
        if not arc.queued:
            return None, math.inf
        slots = self._schedule.planner_of(arc).slots_around(arc, now_s)
        own = next((slot for slot in slots if slot.arc is arc), None)
        if own is None:
            raise AssertionError(f"the planner's slots_around({arc.name}) has no slot of {arc.name}, which is queued")
        return own, self._prediction.grants_s(slots, now_s)[arc]

    def _until_s(self, arc: ArcEntry) -> float:
        match arc.state:
            case RequestState.RUNNING:
                return arc.end_s
            case RequestState.CONNECTING:
                return arc.began_s + arc.length_s
            case _:
                return UNKNOWN_S


def _what_brings_back(rc: RcEntry) -> str:
    if rc.fault:
        return f"its report is credible again; a restart helps: 'scout-backbone stop {rc.name}', then 'start {rc.kind}'"
    return "its process answers, and its hardware is in the safe state"


def _expected_s(arc: ArcEntry, granted_s: float) -> float:
    """Return the predicted time of the next grant; negative: it is granted already, or no grant is foreseeable."""
    if arc.state is RequestState.CONNECTING:
        return arc.began_s + arc.settle_s
    return granted_s if granted_s < math.inf else UNKNOWN_S


def _reason(arc: ArcEntry) -> str:
    return _REASONS.get(arc.swapped_out, arc.swapped_out).format(by=arc.swapped_out_by)


def _names(arcs: Sequence[ArcEntry]) -> str:
    """Return the names of at least one ARC."""
    *firsts, last = [arc.name for arc in arcs]
    return f"{', '.join(firsts)} and {last}" if firsts else last


def _release(arcs: Sequence[ArcEntry]) -> str:
    return f"{_names(arcs)} {'releases or idles' if len(arcs) == 1 else 'release or idle'}"


def _at(time_s: float) -> str:
    return f"{time_s:.2f} s"
