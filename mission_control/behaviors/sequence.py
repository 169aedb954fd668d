"""Sequence: one child after the other, until one fails."""

from __future__ import annotations

from typing import Literal

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import PATIENCE_S, Composed, Seconds
from mission_control.composites import InSequence


class SequenceParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Sequence``.

    Attributes:
        while_suspended: Effect of a suspended child. wait: the sequence waits for it. fail: after patience_s it counts
            as failed. No later child replaces it, because the order matters; if it does not, use a fallback with next,
            or a parallel.
        patience_s: With fail, the mission time for which a child may be suspended.
    """

    while_suspended: Literal["wait", "fail"] = "wait"
    patience_s: Seconds = PATIENCE_S


class Sequence(Composed[SequenceParameters]):
    """Runs its children one after the other; succeeds after all have succeeded, fails with the first that fails."""

    parameters_type = SequenceParameters
    rules_type = InSequence
