"""Composed: base class of behaviors that a mission file composes of other behaviors.

They hold no ARC. ``mission_control.composites`` has their rules; the parameters are the settings of these rules.
Children run in the order of the mission file; priorities matter only for scheduling.

Source: BehaviorTree.CPP 4, "Nodes Library": Sequence, Fallback, Parallel, RetryUntilSuccessful, Repeat, Timeout, Sleep.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, TypeVar

import msgspec

from backbone.ranges import A_DAY_S
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behaviors.motion import MOST_TIMES
from mission_control.children import BRANCH
from mission_control.composites import ENDLESS, Composite, WhileSuspended

MOST_CHILDREN = 256  # chosen: the largest length of a path; a mission has a dozen children
PAUSE_S = 1.0  # chosen: ten times the start time of a process, so that a child that fails at once costs little
PATIENCE_S = 10.0  # chosen: two of the papers' slices


Seconds = Annotated[float, msgspec.Meta(gt=0, le=A_DAY_S)]
"""A finite duration in mission time."""
Pause = Annotated[float, msgspec.Meta(ge=0, le=A_DAY_S)]
"""A finite duration in mission time, or 0."""
Times = Annotated[int, msgspec.Meta(ge=ENDLESS, le=MOST_TIMES)]
"""A number of repetitions, or without end."""
Threshold = Annotated[int, msgspec.Meta(ge=-MOST_CHILDREN, le=MOST_CHILDREN, extra_json_schema={"counts": "children"})]
"""A number of children, at most all of them; negative: counted from the number of all children, -1 being all."""

_SETTINGS = {"num_cycles": "most", "num_attempts": "most"}  # parameter → setting of the rules, if the names differ

P = TypeVar("P", bound=BehaviorParameters)


class Composed(Behavior[P]):
    """A parent that decides by rules, and reports to people and to its own parent which branch runs, and why."""

    rules_type: ClassVar[type[Composite]]
    children_allowed = (1, MOST_CHILDREN)
    may_claim = False

    def rules(self, children: Sequence[str]) -> Composite:
        """Return the rules of ``rules_type``, with the parameters as their settings."""
        return self.rules_type(children, **self._settings())

    def parameters_changed(self) -> None:
        """Apply the new settings from now on, also to running times and counts."""
        for name, value in self._settings().items():
            setattr(self._children.rules, name, value)
        self._children.look_again()

    def _settings(self) -> dict[str, Any]:
        """Return the parameters that do not come from the tree."""
        own = [name for name in self.parameters.__struct_fields__ if name not in BehaviorParameters.__struct_fields__]
        settings = {_SETTINGS.get(name, name): getattr(self.parameters, name) for name in own}
        if "while_suspended" in settings:
            settings["while_suspended"] = WhileSuspended(settings["while_suspended"])
        return settings

    def children_arranged(self) -> None:
        """Report which children run, and why."""
        rules = self._children.rules
        if rules.sentence and rules.sentence != self.feedback:
            self.report(rules.sentence)
        told = {BRANCH: rules.remarks()}
        if told != self.payload:
            self.tell_parent(told)
