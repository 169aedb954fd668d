"""Pace: due times and delays of the steps of a loop at a fixed rate.

Pure; times are mission seconds. A late step does not shift later steps; missed steps are skipped.
"""

from __future__ import annotations

import math


class Pace:
    """The steps of one loop.

    Args:
        step_s: Time from one step to the next.
    """

    def __init__(self, step_s: float) -> None:
        self._step_s = step_s
        self.due_s = 0.0
        """Due time of the next step."""
        self.steps = 0
        self.late = 0
        """Steps that began more than half a step after they were due."""
        self.worst_s = 0.0
        """The greatest delay of a step."""

    def begin(self, now_s: float) -> None:
        """Make the next step due now."""
        self.due_s = now_s

    def step(self, now_s: float) -> None:
        """Count the step that begins now, and set the due time of the next step."""
        late_s = max(0.0, now_s - self.due_s)
        self.steps += 1
        self.late += late_s > self._step_s / 2
        self.worst_s = max(self.worst_s, late_s)
        self.due_s += self._step_s * (1 + math.floor(late_s / self._step_s))

    def statistics(self) -> dict[str, float]:
        """Return the counts and the worst delay."""
        return {"steps": self.steps, "late": self.late, "worst_ms": self.worst_s * 1e3}
