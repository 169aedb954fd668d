"""Timers: what changes because time has passed, and when the next of it is due.

Four things need no event: an ARC that wants time again later, the end of a slice, a rise by aging (rule 8), and holders
whose packets are late together (rule 1).
"""

from __future__ import annotations

from backbone.scheduling.arc_events import ArcEvents
from backbone.scheduling.entries import Decision
from backbone.scheduling.events import WakeAt
from backbone.scheduling.priority_events import PriorityEvents
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.slice_ends import SliceEnds


class Timers:
    """Applies what is due, and sets the alarm.

    Attributes:
        wake_s: Mission time at which the caller was asked to wake the manager; None: it was not.
    """

    def __init__(
        self,
        decision: Decision,
        arcs: ArcEvents,
        ends: SliceEnds,
        priorities: PriorityEvents,
        rules: SchedulingRules,
    ) -> None:
        self._decision = decision
        self._arcs = arcs
        self._ends = ends
        self._priorities = priorities
        self._has_aging = rules.aging_s > 0
        self.wake_s: float | None = None

    def ring(self) -> None:
        """Apply what is due by now."""
        if self._arcs.retrying:
            self._arcs.retry()
        self._ends.check(self._decision.now_s)
        if self._has_aging:
            self._priorities.age()
        if self._arcs.understating:
            self._arcs.ask_anew_where_late()

    def set(self, *, rang: bool) -> None:
        """Have the caller wake the manager when the next decision can be due without an event.

        Args:
            rang: True if the last alarm rang just now: it is set again also for the same time.
        """
        times_s = [self._ends.check(self._decision.now_s)]
        if self._arcs.retrying:
            times_s.append(self._arcs.next_retry_s())
        if self._has_aging:
            times_s.append(self._priorities.next_aging_s())
        wake_s = min((time_s for time_s in times_s if time_s is not None), default=None)
        if rang or wake_s != self.wake_s:
            self.wake_s = wake_s
            self._decision.instructions.append(WakeAt(wake_s))
