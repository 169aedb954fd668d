"""Sequence: one child after the other, until one fails."""

from __future__ import annotations

from collections.abc import Sequence as Names

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.composed import Composed
from mission_control.composites import InSequence


class Sequence(Composed[BehaviorParameters]):
    """Runs its children one after the other; succeeds after all have succeeded, fails with the first that fails."""

    def rules(self, children: Names[str]) -> InSequence:
        """Return the rules of a sequence."""
        return InSequence(children)
