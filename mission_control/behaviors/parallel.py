"""Parallel: all children at the same time, until enough have succeeded or failed."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PATIENCE_S, Composed, Seconds, Threshold
from mission_control.composites import ENDLESS
from mission_control.in_parallel import InParallel


class ParallelParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Parallel``.

    Attributes:
        success_count: Number of children that must succeed, 1 for any; -1: all, -2: all but one, and so on, but
            at least one.
        failure_count: Number of children that must fail for a failure; negative as above.
        while_suspended: Effect of a suspended child. wait: it counts as at work. fail: after patience_s it counts as
            failed. skip: after patience_s it is not counted until it is at work again.
        patience_s: With fail or skip, the mission time for which a child may be suspended.
    """

    success_count: Threshold = ENDLESS
    failure_count: Threshold = 1
    while_suspended: Literal["wait", "fail", "skip"] = "wait"
    patience_s: Seconds = PATIENCE_S

    def __post_init__(self) -> None:
        if self.success_count == 0:
            raise ValueError("success_count is 0: write how many must succeed, or -1 for all")
        if self.failure_count == 0:
            raise ValueError("failure_count is 0: write how many must fail, or -1 for all")


class Parallel(Composed[ParallelParameters]):
    """Runs its children at the same time; succeeds or fails as soon as enough of them have, and ends the others."""

    parameters_type = ParallelParameters
    rules_type = InParallel
