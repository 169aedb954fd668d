"""Closing: the last steps of a decision.

ARCs that stay begin new slices. When no turn is left, revoked ARCs get their expected times, and the alarm is set.
"""

from __future__ import annotations

import math
from dataclasses import replace

from backbone.scheduling.arc_events import ArcEvents
from backbone.scheduling.events import RevokeArc, WakeAt
from backbone.scheduling.priority import rank_of
from backbone.scheduling.priority_events import PriorityEvents
from backbone.scheduling.transitions import Transitions


class Closing:
    """Closes decisions.

    Attributes:
        wake_s: Mission time at which the caller must wake the manager; None: no time.
    """

    def __init__(self, transitions: Transitions, arcs: ArcEvents, priorities: PriorityEvents) -> None:
        self._decision, self._transitions = transitions.decision, transitions
        self._schedule, self._ends = transitions.schedule, transitions.ends
        self._arcs = arcs
        self._priorities = priorities
        self._has_aging = transitions.rules.aging_s > 0
        self.wake_s: float | None = None

    def renew_slices(self) -> bool:
        """Begin a new slice of served equals that stay on a sharable RC where another slice was ended (rule 5).

        Returns:
            Whether a slice began: then the plan has changed, and a turn may have come.
        """
        decision, renewed = self._decision, False
        for ended, rc in decision.ended:
            for arc in [*self._schedule.state.rcs[rc].holders]:
                if rc in arc.shares and arc.served(decision.now_s) and not rank_of(arc, ended):
                    self._transitions.renew(arc)
                    renewed = True
        decision.ended = []
        return renewed

    def close(self, *, rang: bool) -> None:
        """Add the last instructions of a decision.

        Args:
            rang: True if the last alarm has just rung; it is then set again, even for the same time.
        """
        self._expect()
        times_s = [self._ends.check(self._decision.now_s)]
        if self._arcs.retrying:
            times_s.append(self._arcs.next_retry_s())
        if self._has_aging:
            times_s.append(self._priorities.next_aging_s())
        wake_s = min((time_s for time_s in times_s if time_s is not None), default=None)
        if rang or wake_s != self.wake_s:
            self.wake_s = wake_s
            self._decision.instructions.append(WakeAt(wake_s))

    def _expect(self) -> None:
        """Add the predicted next grants of revoked ARCs to the instructions."""
        for place, instruction in enumerate(self._decision.instructions):
            if not isinstance(instruction, RevokeArc):
                continue
            arc = self._schedule.state.arcs.get(instruction.arc)
            if arc is not None and arc.queued:
                start_s = self._schedule.planner_of(arc).start_s(arc, self._decision.now_s)
                if start_s < math.inf:
                    self._decision.instructions[place] = replace(instruction, expected_s=start_s + arc.settle_s)
