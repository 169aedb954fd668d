"""Retry: starts a child again as long as it fails."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PATIENCE_S, PAUSE_S, Composed, Pause, Seconds, Times
from mission_control.composites import WithRetries


class RetryParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Retry``.

    Attributes:
        num_attempts: Number of attempts, including the first; -1: endless.
        pause_s: Mission time from an end of the child to its next start.
        while_suspended: Effect of a suspended child. wait: the retry waits for it. fail: after patience_s the attempt
            counts as failed, and the child is started again.
        patience_s: With fail, the mission time for which the child may be suspended.
    """

    num_attempts: Times
    pause_s: Pause = PAUSE_S
    while_suspended: Literal["wait", "fail"] = "wait"
    patience_s: Seconds = PATIENCE_S

    def __post_init__(self) -> None:
        if self.num_attempts == 0:
            raise ValueError("num_attempts is 0: write how many, or -1 for no end")


class Retry(Composed[RetryParameters]):
    """Starts its child again while it fails; succeeds with the child, fails after the last attempt."""

    parameters_type = RetryParameters
    rules_type = WithRetries
    children_allowed = (1, 1)
