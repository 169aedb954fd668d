"""Fallback: one child after the other, until one succeeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed, Pause
from mission_control.composites import InFallback, WhileSuspended


class FallbackParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Fallback``.

    Attributes:
        while_suspended: What a suspended child means. wait: it stands still, and the fallback waits. next: it is not
            available, and the next child runs until it is at work again.
        patience_s: With next, the time for which a child may be suspended before the next child starts.
    """

    while_suspended: Literal["wait", "next"] = "wait"
    patience_s: Pause = 10.0  # chosen: two of the papers' slices


class Fallback(Composed[FallbackParameters]):
    """Tries its children one after the other; succeeds with the first that succeeds, fails after all have failed."""

    parameters_type = FallbackParameters

    def rules(self, children: Sequence[str]) -> InFallback:
        """Return the rules of a fallback."""
        self._rules = InFallback(children)
        self._set_rules()
        return self._rules

    def parameters_changed(self) -> None:
        """Apply them from now on."""
        self._set_rules()
        self._children.look_again()

    def _set_rules(self) -> None:
        self._rules.while_suspended = WhileSuspended(self.parameters.while_suspended)
        self._rules.patience_s = self.parameters.patience_s
