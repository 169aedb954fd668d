"""Repeat: starts a child again as long as it succeeds."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PATIENCE_S, PAUSE_S, Composed, Pause, Seconds, Times
from mission_control.composites import WithRepeats


class RepeatParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Repeat``.

    Attributes:
        num_cycles: Number of cycles, including the first; -1: endless.
        pause_s: Mission time from an end of the child to its next start.
        while_suspended: Effect of a suspended child. wait: the repeat waits for it. fail: after patience_s the cycle
            counts as failed, and the repeat fails.
        patience_s: With fail, the mission time for which the child may be suspended.
    """

    num_cycles: Times
    pause_s: Pause = PAUSE_S
    while_suspended: Literal["wait", "fail"] = "wait"
    patience_s: Seconds = PATIENCE_S

    def __post_init__(self) -> None:
        if self.num_cycles == 0:
            raise ValueError("num_cycles is 0: write how many, or -1 for no end")


class Repeat(Composed[RepeatParameters]):
    """Starts its child again while it succeeds; succeeds after the last cycle, fails with the child."""

    parameters_type = RepeatParameters
    rules_type = WithRepeats
    children_allowed = (1, 1)
