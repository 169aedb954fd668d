"""Timeout: a child for a limited time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed, Seconds
from mission_control.composites import WhileSuspended, WithTimeout


class TimeoutParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Timeout``.

    Attributes:
        seconds: Mission time after which the child is ended.
        while_suspended: Whether the time counts in which the child is suspended. wait: it does not. count: it does.
    """

    seconds: Seconds
    while_suspended: Literal["wait", "count"] = "wait"


class Timeout(Composed[TimeoutParameters]):
    """Runs its child for a limited time; has the child's result, or fails when the time is over."""

    parameters_type = TimeoutParameters
    children_allowed = (1, 1)

    def rules(self, children: Sequence[str]) -> WithTimeout:
        """Return the rules of a timeout."""
        self._rules = WithTimeout(children, seconds=self.parameters.seconds)
        self._set_rules()
        return self._rules

    def parameters_changed(self) -> None:
        """Apply them from now on, to the time that has already passed too."""
        self._set_rules()
        self._children.look_again()

    def _set_rules(self) -> None:
        self._rules.seconds = self.parameters.seconds
        self._rules.while_suspended = WhileSuspended(self.parameters.while_suspended)
