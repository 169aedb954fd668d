"""Start prediction: the next grants of waiting ARCs, hand-overs included.

The plan consists of slices only, because it decides which ARC may start, and a hand-over must not cost an ARC its gap.
The prediction adds the time until the RCs of the preceding ARC are free.

Rule of this file: it predicts and decides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.planner import Slot
from backbone.scheduling.prefix_maximum import PrefixMaximum
from backbone.scheduling.priority import higher
from backbone.scheduling.requests import RequestState
from backbone.scheduling.rules import SchedulingRules


class Foreseen(NamedTuple):
    """The schedule played forward.

    Attributes:
        grants_s: ARC → time of its next grant.
        until_s: End of the played time.
    """

    grants_s: Mapping[str, float]
    until_s: float

    def or_planned(self, planned_s: Mapping[ArcEntry, float]) -> dict[ArcEntry, float]:
        """Return the grants of these ARCs as foreseen, or as planned if that is after the played time."""
        later_s = {arc: time_s if time_s > self.until_s else math.inf for arc, time_s in planned_s.items()}
        return {arc: self.grants_s.get(arc.name, time_s) for arc, time_s in later_s.items()}


class StartPrediction:
    """Predicts grants from one master schedule."""

    def __init__(self, schedule: MasterSchedule, rules: SchedulingRules) -> None:
        """Predict for this schedule.

        Args:
            schedule: The schedule; nothing in it changes.
            rules: Rules of the decisions; the prediction assumes that half of the time to stop cleanly is used.
        """
        self._schedule = schedule
        self._table = schedule.table
        self._pause_s = rules.grace_s / 2
        self._rules = rules

    def grants_s(self, slots: Sequence[Slot], now_s: float) -> dict[ArcEntry, float]:
        """Return the time of each grant if no event comes; infinite: not foreseeable.

        Args:
            slots: Places of all queued ARCs of a group, in order.

        Raises:
            AssertionError: The planner, one's own perhaps, is wrong: the start of an ARC is no time.
        """
        for slot in slots:
            if math.isnan(slot.start_s):
                raise AssertionError(
                    f"the planner's start of {slot.arc.name} is {slot.start_s}, not a time or infinite"
                )
        starts_s: dict[ArcEntry, float] = {}
        for slot in sorted(slots, key=lambda slot: slot.start_s):  # an ARC starts later than those it waits for
            start_s = slot.start_s
            if start_s < math.inf and self._schedule.planner_of(slot.arc).is_exact:
                start_s = max([start_s, *self._frees_s(slot, starts_s, now_s)])
            starts_s[slot.arc] = start_s
        if self._table.strict:
            self._let_higher_go_first(slots, starts_s)
        return {arc: start_s + arc.settle_s for arc, start_s in starts_s.items()}

    def _frees_s(self, slot: Slot, starts_s: dict[ArcEntry, float], now_s: float) -> list[float]:
        """Return the times at which the RCs that the ARC waits for will be free."""
        arc = slot.arc
        times_s = []
        for other, begin_s, end_s in slot.against:
            if end_s > slot.start_s + INSTANT_S:
                continue  # it runs beside or after it
            if begin_s > -math.inf:
                over_s = self._end_s(starts_s.get(other, begin_s) + other.settle_s, other)
            elif other.state is RequestState.REVOKING:
                continue  # its release is in the plan
            else:
                over_s = end_s
            if abs(end_s - slot.start_s) <= INSTANT_S or not self._table.fits(arc, [other]):
                times_s.append(over_s + self._release_s(other, arc))
        for holder in dict.fromkeys(holder for rc in arc.uses for holder in self._table.state.rcs[rc].holders):
            displaced = slot.start_s <= now_s + INSTANT_S and holder is not arc
            if displaced and holder.state is not RequestState.REVOKING and not self._table.fits(arc, [holder]):
                times_s.append(now_s + self._release_s(holder, arc))
        return times_s

    def _end_s(self, granted_s: float, arc: ArcEntry) -> float:
        return self._rules.slice_end_s(granted_s, arc.minimum_s)

    def _release_s(self, held_by: ArcEntry, arc: ArcEntry) -> float:
        overridden = higher(arc.path, held_by.path) or held_by.request.stops_at_once
        return held_by.release_s + (0.0 if overridden else self._pause_s)

    def _let_higher_go_first(self, slots: Sequence[Slot], starts_s: dict[ArcEntry, float]) -> None:
        above = PrefixMaximum()
        for slot in slots:  # in order: the starts of higher ARCs are known
            start_s = above.largest(slot.arc.path)
            if start_s > starts_s[slot.arc]:
                starts_s[slot.arc] = self._beside_reserved_s(slot, start_s)
            if self._table.usable(slot.arc):
                above.add(slot.arc.path, starts_s[slot.arc])

    def _beside_reserved_s(self, slot: Slot, start_s: float) -> float:
        """Return the first time from ``start_s`` on at which the reservations of others leave room for the ARC."""
        for other, begin_s, end_s in sorted(slot.against, key=lambda hold: hold[1]):
            meets = (
                begin_s < start_s + slot.arc.length_s and end_s > start_s and not self._table.fits(slot.arc, [other])
            )
            if meets:
                start_s = math.inf if higher(other.path, slot.arc.path) else end_s + self._release_s(other, slot.arc)
        return start_s
