"""Answers: answers questions about the schedule of one schedule manager.

Rule of this file: it reads and never changes; the future is played forward on a copy.
"""

from __future__ import annotations

import copy
from collections.abc import Collection
from typing import NamedTuple

import msgspec

from backbone.errors import complaint
from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import Freed, Opened
from backbone.scheduling.explain.attributes import attributes
from backbone.scheduling.explain.explanation import Explanation
from backbone.scheduling.explain.packet_lines import never_served, packet_lines
from backbone.scheduling.explain.start_prediction import Foreseen
from backbone.scheduling.own_planner import WrongPlanner
from backbone.scheduling.rehearsal import Rehearsal
from backbone.scheduling.requests import RequestState, Scheduled, UnknownRequest
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.views import Attributes, Schedule, Why

FORESEEN_S = 300.0  # chosen: a start later than in five minutes is no answer to an operator
FORESEEN_LINES = 1000  # chosen: some two hundred slices
FORESEEN_WORK = 250_000  # measured: lines × ARCs², of which 32 ARCs take 0.1 s, or 0.25 s under discipline ``time``

COPIES = (
    "Starts are predicted with a copy of the planner: keep locks, threads and open files out of its attributes, "
    "or write a __deepcopy__."
)


class Unservable(NamedTuple):
    """A waiting ARC that sharable RCs could not serve even alone.

    Attributes:
        since_s: Mission time since which it waits.
        until: The event that would let it run.
    """

    arc: str
    since_s: float
    why: str
    until: str


class Answers:
    """The schedule in words: holders, waiting ARCs, blockers, reasons and times."""

    def __init__(self, manager: ScheduleManager) -> None:
        """Answer about the schedule of this manager.

        Args:
            manager: The schedule manager; nothing in it changes.

        Raises:
            WrongPlanner: The mission's own planner cannot be copied.
        """
        self._manager = manager
        if manager.rules.planner:  # the RC manager's own planners can be copied, and a copy of a large schedule is slow
            self._copied()
        self._state = manager.master_schedule.state
        self._explanation = Explanation(manager.master_schedule, manager.rules, self._foresee)

    def scheduled(self, arc: str, now_s: float) -> Scheduled:
        """Return the state of this ARC's request.

        Raises:
            UnknownRequest: The ARC has no request.
        """
        if arc not in self._state.arcs:
            raise UnknownRequest(f"no request of {arc!r} is known", name=arc)
        return self._explanation.scheduled(self._state.arcs[arc], self._not_before(now_s))

    def schedule(self, now_s: float) -> Schedule:
        """Return the holders, the waiting ARCs with their blockers, and the times."""
        return self._explanation.schedule(self._not_before(now_s))

    def why(self, name: str, now_s: float) -> Why:
        """Return the reasons for the state of an ARC, an owner (name or address) or an RC.

        Raises:
            UnknownRequest: No ARC, owner or RC has this name.
        """
        at_s = self._not_before(now_s)
        return msgspec.structs.replace(self._explanation.why(name, at_s), at_s=at_s)

    def unservable(self) -> list[Unservable]:
        """Return the waiting ARCs that sharable RCs could not serve even alone."""
        rcs, usable = self._state.rcs, self._manager.master_schedule.table.usable
        waiting = (arc for arc in self._state.arcs.values() if arc.state is RequestState.WAITING and not usable(arc))
        never = {arc: never_served(arc, self._state) for arc in waiting if all(rcs[rc].up for rc in arc.uses)}
        return [
            Unservable(arc.name, arc.since_s, "; ".join([why, *packet_lines(arc)]), until)
            for arc, (why, until) in never.items()
        ]

    def wanting(self) -> set[str]:
        """Return the ARCs that want time now, or want it again soon after a failed connection."""
        arcs = self._state.arcs.values()
        return {arc.name for arc in arcs if arc.state is not RequestState.IDLE or arc.retry_s is not None}

    def waiting(self) -> set[str]:
        """Return the ARCs that wait for others, or for RCs."""
        return {arc.name for arc in self._state.arcs.values() if arc.state is RequestState.WAITING}

    def attributes(self, name: str) -> Attributes:
        """Return the requests of an ARC, of an owner (name or address), or of a node and its descendants.

        Raises:
            UnknownRequest: No ARC, owner or node has this name.
        """
        return attributes(self._state.arcs.values(), name, self._manager.tree.nodes)

    def _not_before(self, now_s: float) -> float:
        """Return the time of the question, but not before the last decision."""
        return max(now_s, self._manager.decided_s)

    def _foresee(self, arcs: Collection[ArcEntry], now_s: float) -> Foreseen:
        """Return when waiting ARCs are granted without further events, by playing a copy forward."""
        rehearsal = self._going_on(now_s)
        most_lines = min(FORESEEN_LINES, FORESEEN_WORK // len(self._state.arcs) ** 2)
        waiting = {arc.name for arc in arcs}
        grants_s: dict[str, float] = {}
        seen = 0
        while waiting and len(rehearsal.trace) < most_lines:
            if not rehearsal.step(now_s + FORESEEN_S):
                return Foreseen(grants_s, now_s + FORESEEN_S)
            for line in rehearsal.trace[seen:]:
                if line["ev"] == "grant" and line["arc"] in waiting:
                    waiting.remove(line["arc"])
                    grants_s[line["arc"]] = rehearsal.now_s
            seen = len(rehearsal.trace)
        return Foreseen(grants_s, rehearsal.now_s)

    def _going_on(self, now_s: float) -> Rehearsal:
        """Return a rehearsal of the future; it assumes that processes use half of the time to stop cleanly."""
        under_way: list[tuple[float, Opened | Freed]] = []
        grace_s = self._manager.rules.grace_s
        for arc in self._state.arcs.values():
            if arc.state is RequestState.CONNECTING:
                under_way.append((max(now_s, arc.began_s + arc.settle_s), Opened(arc.name)))
            elif arc.state is RequestState.REVOKING:
                pause_s = grace_s / 2 if arc.swapped_out == "slice" and not arc.request.stops_at_once else 0.0
                under_way.append((max(now_s, arc.since_s + pause_s + arc.release_s), Freed(arc.name)))
        return Rehearsal.going_on(
            self._copied(),
            now_s,
            under_way=sorted(under_way, key=lambda item: item[0]),
            release_s={rc.name: rc.disconnect_s for rc in self._state.rcs.values()},
            wake_s=self._manager.wake_s,
            pause_s=lambda deadline_s: deadline_s / 2,
        )

    def _copied(self) -> ScheduleManager:
        try:
            return copy.deepcopy(self._manager)
        except Exception as error:  # an own planner may have attributes of any kind
            if not self._manager.rules.planner:
                raise
            told = f"{self._manager.rules.planner} cannot be copied: {complaint(error)}"
            raise WrongPlanner(told, remedy=COPIES) from error
