"""Retry: a child again while it fails."""

from __future__ import annotations

from collections.abc import Sequence

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PAUSE_S, Composed, Pause, Times
from mission_control.composites import WithRetries


class RetryParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Retry``.

    Attributes:
        num_attempts: Number of attempts, the first included; -1: without end.
        pause_s: Mission time from an end of the child to its next start.
    """

    num_attempts: Times
    pause_s: Pause = PAUSE_S

    def __post_init__(self) -> None:
        if self.num_attempts == 0:
            raise ValueError("num_attempts is 0: write how many, or -1 for no end")


class Retry(Composed[RetryParameters]):
    """Starts its child again while it fails; succeeds with the child, fails after the last attempt."""

    parameters_type = RetryParameters
    children_allowed = (1, 1)

    def rules(self, children: Sequence[str]) -> WithRetries:
        """Return the rules of a retry."""
        self._rules = WithRetries(children, most=self.parameters.num_attempts)
        self._set_rules()
        return self._rules

    def parameters_changed(self) -> None:
        """Apply them at the next end of the child."""
        self._set_rules()

    def _set_rules(self) -> None:
        self._rules.most, self._rules.pause_s = self.parameters.num_attempts, self.parameters.pause_s
