"""Composed: base of the behaviors that a mission file composes of others.

They hold no ARC and decide nothing of their own: ``mission_control.composites`` has their rules. Order is that of the
mission file; priorities stay what they are, a matter of scheduling.

Source: BehaviorTree.CPP 4, "Nodes Library": Sequence, Fallback, Parallel, RetryUntilSuccessful, Repeat, Timeout, Sleep.
"""

from __future__ import annotations

from typing import Annotated, TypeVar

import msgspec

from backbone.ranges import A_DAY_S
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.children import BRANCH
from mission_control.composites import ENDLESS

MOST_CHILDREN = 256  # chosen: as many as a path may have steps; a mission has a dozen
PAUSE_S = 1.0  # chosen: ten times the start of a process, so that a child that fails at once costs little
PATIENCE_S = 10.0  # chosen: two of the papers' slices
MOST_TIMES = 100_000  # chosen: once a minute for ten weeks

Seconds = Annotated[float, msgspec.Meta(gt=0, le=A_DAY_S)]
"""A mission time that is over at some time."""
Pause = Annotated[float, msgspec.Meta(ge=0, le=A_DAY_S)]
"""A mission time that may be none."""
Times = Annotated[int, msgspec.Meta(ge=ENDLESS, le=MOST_TIMES)]
"""How often, or without end."""
Threshold = Annotated[int, msgspec.Meta(ge=-MOST_CHILDREN, le=MOST_CHILDREN)]
"""How many children; negative: counted from all of them, which are -1."""

P = TypeVar("P", bound=BehaviorParameters)


class Composed(Behavior[P]):
    """A parent that decides by rule, and reports which branch runs and why: to people, and to its own parent."""

    children_allowed = (1, MOST_CHILDREN)
    may_claim = False

    def children_arranged(self) -> None:
        """Report which children run, and why."""
        rules = self._children.rules
        if rules.sentence and rules.sentence != self.feedback:
            self.report(rules.sentence)
        told = {BRANCH: rules.remarks()}
        if told != self.payload:
            self.tell_parent(told)
