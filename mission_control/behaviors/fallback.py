"""Fallback: one child after the other, until one succeeds."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PATIENCE_S, Composed, Pause
from mission_control.composites import InFallback


class FallbackParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Fallback``.

    Attributes:
        while_suspended: Effect of a suspended child. wait: the fallback waits for it. next: the next child runs until
            the suspended child is at work again. fail: it counts as failed for good.
        patience_s: With next or fail, the mission time for which a child may be suspended before that; with fail above
            0.
    """

    while_suspended: Literal["wait", "next", "fail"] = "wait"
    patience_s: Pause = PATIENCE_S

    def __post_init__(self) -> None:
        if self.while_suspended == "fail" and self.patience_s == 0:
            raise ValueError("patience_s is 0: with fail, a child fails before its first grant; write more")


class Fallback(Composed[FallbackParameters]):
    """Tries its children one after the other; succeeds with the first that succeeds, fails after all have failed."""

    parameters_type = FallbackParameters
    rules_type = InFallback
