"""Blockers: the ARCs without which a waiting ARC gets its RCs as soon as these are free.

There are two questions. The plan names the *direct* blockers at once, for every request in the
schedule. *All* blockers include the ARCs that would come before the ARC if the direct ones were gone;
this costs a plan for each of them, and is computed for one ARC on demand.

Rule of this file: in doubt it names one blocker too many, never one too few.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence

from backbone.scheduling.entries import CONNECTED, HOLDING, INSTANT_S, ArcEntry
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.plan import meeting
from backbone.scheduling.planner import Slot
from backbone.scheduling.preemption import left_over
from backbone.scheduling.priority import higher, rank_of
from backbone.scheduling.requests import RequestState

FEWEST_OF = 24  # chosen: each costs one more plan; a longer list is not reduced
MEANWHILE_OF = 64  # chosen: so many are planned in a few milliseconds


class Blockers:
    """Answers about one master schedule."""

    def __init__(self, schedule: MasterSchedule) -> None:
        """Answer for this schedule.

        Args:
            schedule: The schedule; nothing in it changes.
        """
        self._schedule = schedule
        self._table = schedule.table
        self._state = schedule.state
        self._in_turns = schedule.state.fairness.discipline == "turns"

    def direct(self, slot: Slot, now_s: float) -> list[ArcEntry]:
        """Return the ARCs that block the planned ARC now or have a reservation in its time, in order.

        In a large group: the ARCs that block it and those first in line before it.
        """
        arc, planner = slot.arc, self._schedule.planner_of(slot.arc)
        if held_back_by := self.held_back_by(arc):
            return held_back_by
        met = [*dict.fromkeys(other for other, _, _ in meeting(slot.against, now_s, now_s + arc.length_s))]
        if not self._in_turns:
            met += [one for one in self._holders_in_the_way(arc, now_s) if one.state in CONNECTED and one not in met]
        met += [first for first in planner.firsts_before(arc) if first not in met]
        alone = [other for other in met if not self._table.fits(arc, [other])]
        if not met and not planner.is_exact:
            return planner.before(arc)[:1]
        return alone or met

    def held_back_by(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the first higher ARC that waits, if nothing but the policy ``strict`` keeps this one from its RCs."""
        if not self._table.strict or not self._table.fits(arc, self._table.holders(arc)):
            return []
        return [*itertools.islice(self._higher_ones(arc), 1)]

    def altogether(self, arc: ArcEntry, now_s: float, *, grace_s: float) -> list[ArcEntry]:
        """Return a set of ARCs without which this one starts as soon as its RCs are free; small, not always smallest.

        If an RC of it is down or has too little capacity: the blockers after the RC is up and has enough.

        Args:
            grace_s: Time that a decision process has to stop cleanly at the end of a slice.

        Returns:
            The ARCs in the order in which to remove them; empty if only RCs settle or become free.
        """
        held, rivals = self._holders_in_the_way(arc, now_s), self._rivals(arc)
        left = {*left_over(self._table, arc, [], [*held, *(one for one in rivals if one.touches & arc.touches)])}
        found = [one for one in dict.fromkeys([*held, *rivals]) if one in left or self._held_back_by(one, arc)]
        if self._is_planned_whole(arc) and self._table.usable(arc) and self._in_turns and len(found) <= FEWEST_OF:
            group = [one for one in self._state.group_of(arc) if one.holds or one is arc or one in rivals]
            for other in reversed(found):
                fewer = [one for one in found if one is not other]
                if self._starts_without(fewer, arc, group, now_s, grace_s):
                    found = fewer
        while meanwhile := self._starting_meanwhile(found, arc, now_s):
            found = [*meanwhile, *found]
        return found

    def _is_planned_whole(self, arc: ArcEntry) -> bool:
        return self._schedule.planner_of(arc).is_exact

    def _held_back_by(self, one: ArcEntry, arc: ArcEntry) -> bool:
        return self._table.strict and one.state is not RequestState.RUNNING and higher(one.path, arc.path)

    def _starting_meanwhile(self, gone: Sequence[ArcEntry], arc: ArcEntry, now_s: float) -> list[ArcEntry]:
        """Return the ARCs that would start and block the ARC when only its first blockers are gone."""
        group = self._state.group_of(arc) if self._is_planned_whole(arc) else [arc, *self._state.beside(arc)]
        if len(group) > MEANWHILE_OF:
            return []
        found: dict[ArcEntry, None] = {}
        for count in range(1, len(gone) + (not self._table.usable(arc))):
            rest = [one for one in group if one not in gone[:count]]
            slow = [one for one in [*gone[:count], *rest] if one.state in HOLDING and one.release_s > 0]
            for slot in self._schedule.whole.plan(rest, now_s, handed_over=True):
                other = slot.arc
                if slot.start_s > now_s + INSTANT_S or other is arc or other in gone or higher(arc.path, other.path):
                    continue
                waits_for_release = any(
                    one.touches & other.touches and (one in gone or one.state is RequestState.REVOKING) for one in slow
                )
                if not waits_for_release and not self._table.fits(arc, [other]):
                    found[other] = None
        return [*found]

    def _holders_in_the_way(self, arc: ArcEntry, now_s: float) -> list[ArcEntry]:
        """Return the holders of its RCs that it cannot displace now."""
        return [holder for holder in self._table.holders(arc) if self._stays(holder, arc, now_s)]

    def _stays(self, holder: ArcEntry, arc: ArcEntry, now_s: float) -> bool:
        if not self._in_turns and not rank_of(holder, arc):
            return True  # whether its slice ends for this ARC depends on more than time
        return self._table.stands_until_s(holder, arc, now_s) > now_s + INSTANT_S

    def _rivals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the waiting ARCs that could take RCs before the ARC once the ARC could use them, too."""
        down = {rc for rc in arc.uses if not self._state.rcs[rc].up}
        rivals = self._schedule.planner_of(arc).before(arc)
        if not self._in_turns:  # equals reserve nothing from each other: a later one may start first
            equals = [one for one in self._state.beside(arc) if one.queued and not higher(arc.path, one.path)]
            rivals = [*dict.fromkeys([*rivals, *equals])]
        else:
            rivals += [one for one in self._older_equals(arc) if one not in rivals]
        if not self._table.strict:
            rivals = [one for one in rivals if one.touches & arc.touches]
        if down or not self._table.usable(arc):
            return [one for one in rivals if all(self._state.rcs[rc].up or rc in down for rc in one.uses)]
        return [one for one in rivals if self._table.usable(one)]

    def _older_equals(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return equals that are behind the ARC only while an ARC waits that is higher than they are."""
        return [
            one for one in self._state.beside(arc) if one.queued and one.stamp < arc.stamp and not rank_of(one, arc)
        ]

    def _higher_ones(self, arc: ArcEntry) -> Iterator[ArcEntry]:
        """Return the higher waiting ARCs of its group."""
        for other in self._state.group_of(arc):
            if other.state is RequestState.WAITING and higher(other.path, arc.path) and self._table.usable(other):
                yield other

    def _starts_without(
        self,
        gone: Collection[ArcEntry],
        arc: ArcEntry,
        group: Sequence[ArcEntry],
        now_s: float,
        grace_s: float,
    ) -> bool:
        """Return whether the ARC would start after one hand-over without these ARCs."""
        rest = [other for other in group if other not in gone]
        sharing = [other for other in rest if other is not arc and other.holds and other.touches & arc.touches]
        if any(self._stays(h, arc, now_s) and h.state in CONNECTED and not self._table.fits(arc, [h]) for h in sharing):
            return False
        release_s = max((other.release_s for other in [*gone, *sharing] if other.holds), default=0.0)
        latest_s = now_s + release_s + grace_s
        for handed_over in (True, False):
            slots = self._schedule.whole.plan(rest, now_s, handed_over=handed_over, slack_s=0.0)
            own = next(slot for slot in slots if slot.arc is arc)
            if own.start_s > latest_s + INSTANT_S or not self._fits_throughout(own, now_s, latest_s + arc.length_s):
                return False
            starting = {slot.arc for slot in slots if slot.start_s <= now_s + INSTANT_S and slot.arc is not arc}
            order = self._table.in_order([slot.arc for slot in slots if slot.arc not in starting])
            before = self._schedule.planner_of(arc).before(arc)
            overtaking = [one for one in order[: order.index(arc)] if starting and one not in before]
            if any(not self._table.fits(arc, [one]) for one in overtaking):
                return False  # the ARC that held them back starts as well, and then they precede the ARC
            others = [slot for slot in slots if self._table.strict and slot.start_s > now_s + INSTANT_S]
            if any(slot.arc is not arc and higher(slot.arc.path, arc.path) for slot in others):
                return False
        return True

    def _fits_throughout(self, slot: Slot, start_s: float, end_s: float) -> bool:
        """Return whether the ARC fits beside all ARCs of this span, except those whose RCs are being freed."""
        met = [hold for hold in meeting(slot.against, start_s, end_s) if hold[0].state is not RequestState.REVOKING]
        reserved = [hold for hold in slot.against if hold[0].state is RequestState.REVOKING and hold[1] > start_s]
        met += meeting(reserved, start_s, end_s)
        moments = dict.fromkeys([start_s, *(begin_s for _, begin_s, _ in met if begin_s > start_s)])
        return all(
            self._table.fits(
                slot.arc, [one for one, begin_s, over_s in met if begin_s <= moment_s + INSTANT_S < over_s]
            )
            for moment_s in moments
        )
