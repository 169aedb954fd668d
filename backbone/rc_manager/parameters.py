"""Parameters of the RC manager."""

from __future__ import annotations

from backbone.scheduling.events import KeptTree
from backbone.scheduling.rules import SchedulingRules


class RcManagerParameters(SchedulingRules, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The mission, and the rules, by which the RC manager decides.

    Attributes:
        mission: Name of the mission's own node, root of the behavior tree.
        mission_priority: Its priority among the consoles.
        trace: File of the decisions; empty: none.
        tree: The numbers and places that operators set at an earlier RC manager of this mission.
    """

    mission: str
    mission_priority: int = 0
    trace: str = ""
    tree: KeptTree = KeptTree()

    def rules(self) -> SchedulingRules:
        """Return only the scheduling rules."""
        return SchedulingRules(**{rule: getattr(self, rule) for rule in SchedulingRules.__struct_fields__})
