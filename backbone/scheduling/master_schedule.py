"""Master schedule: assigns each group to a planner, and collects the planners' turns in groups that changed.

A decision examines only groups with an event since the last one (rule 7: an event in one group changes no time in
another). A group of up to ``exact_up_to`` ARCs is planned whole, a larger one at each RC.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.large_group import LargeGroupPlanner
from backbone.scheduling.own_planner import PlannerType
from backbone.scheduling.planner import Planner, Slot, Turn
from backbone.scheduling.state import ScheduleState, all_joined
from backbone.scheduling.table import Table
from backbone.scheduling.whole_group import WholeGroupPlanner

EXACT_UP_TO = 64  # chosen: such a group is planned in a few milliseconds


class MasterSchedule:
    """The plans for one state.

    Attributes:
        table: Questions about the state.
        whole: The planner of whole groups, also of hypothetical ones.
        planned_whole_up_to: In groups of at most this size each queued ARC has a reserved start.
    """

    def __init__(
        self,
        state: ScheduleState,
        *,
        strict: bool,
        tolerance_s: float,
        exact_up_to: int,
        planner: PlannerType | None = None,
    ) -> None:
        """Plan for this state.

        Args:
            strict: No ARC starts while a higher usable one of its group waits.
            tolerance_s: Longest overlap of two reservations.
            exact_up_to: Groups of at most this size are planned whole.
            planner: Plans all groups; None: the two planners of this package plan them.
        """
        self.state = state
        self.table = Table(state, strict=strict)
        self.whole = WholeGroupPlanner(self.table, slack_s=tolerance_s)
        self._small: Planner = self.whole
        self._large: Planner = LargeGroupPlanner(self.table, slack_s=tolerance_s)
        if planner is not None:
            self._small = self._large = planner(self.table, slack_s=tolerance_s)
        self._changed_in_large: dict[str, Sequence[ArcEntry]] = {}
        self._exact_up_to = exact_up_to
        whole_up_to = math.inf if self._large.is_exact else exact_up_to
        self.planned_whole_up_to: float = whole_up_to if self._small.is_exact else 0

    def planner_of(self, arc: ArcEntry) -> Planner:
        """Return the planner of an active ARC's group."""
        return self._small if len(self.state.groups.of[arc].arcs) <= self._exact_up_to else self._large

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now, and the holders to revoke for it; None if there is none.

        Examines groups that changed since the last None. Call it again after carrying out the turn.
        """
        self._look_where_it_changed()
        turn = self._small.due(now_s)
        if turn is None:
            for rc, joined in self._changed_in_large.items():
                self._large.look_near(rc, joined)
            self._changed_in_large.clear()
            turn = self._large.due(now_s)
        return turn

    def _look_where_it_changed(self) -> None:
        changed = {rc: joined for rc, joined in self.state.changed.items() if self.state.users.get(rc)}
        self.state.changed.clear()
        planners = {rc: self.planner_of(next(iter(self.state.users[rc]))) for rc in changed}
        for rc, planner in planners.items():
            if planner is self._small:
                planner.look_near(rc, changed[rc])
            else:
                self._changed_in_large[rc] = all_joined(self._changed_in_large.get(rc), changed[rc])
        if (
            self.table.strict and not self._large.is_exact and self._large in planners.values()
        ):  # before the change any ARC of a large group may have been held back
            self._changed_in_large.update(dict.fromkeys(self.state.rcs, ()))

    def forgotten(self, now_s: float) -> ArcEntry | None:
        """Return an ARC whose time is now although no turn was found for it; for checks."""
        for group in self.state.in_groups():
            arc = self.planner_of(group[0]).forgotten(group, now_s)
            if arc is not None:
                return arc
        return None

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of a group, in order."""
        return self.planner_of(group[0]).slots(group, now_s)
