"""Repeat: a child again while it succeeds."""

from __future__ import annotations

from collections.abc import Sequence

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PAUSE_S, Composed, Pause, Times
from mission_control.composites import WithRepeats


class RepeatParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Repeat``.

    Attributes:
        num_cycles: Number of cycles, the first included; -1: without end.
        pause_s: Mission time from an end of the child to its next start.
    """

    num_cycles: Times
    pause_s: Pause = PAUSE_S

    def __post_init__(self) -> None:
        if self.num_cycles == 0:
            raise ValueError("num_cycles is 0: write how many, or -1 for no end")


class Repeat(Composed[RepeatParameters]):
    """Starts its child again while it succeeds; succeeds after the last cycle, fails with the child."""

    parameters_type = RepeatParameters
    children_allowed = (1, 1)

    def rules(self, children: Sequence[str]) -> WithRepeats:
        """Return the rules of a repeat."""
        self._rules = WithRepeats(children, most=self.parameters.num_cycles)
        self._set_rules()
        return self._rules

    def parameters_changed(self) -> None:
        """Apply them at the next end of the child."""
        self._set_rules()

    def _set_rules(self) -> None:
        self._rules.most, self._rules.pause_s = self.parameters.num_cycles, self.parameters.pause_s
