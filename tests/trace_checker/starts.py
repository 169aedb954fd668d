"""Which start and which end of a run is right: PRIO, RR, WC, DELAY, FUTILE, STRICT, MINRUN, SPURIOUS, DEMOTE."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .plan import INSTANT_S, Plan
from .state import Arc, Phase

if TYPE_CHECKING:
    from .replay import Replay


class Starts:
    """Compares each start and each end of a run with the plan of its group."""

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._world = replay.world

    def connects(self, arc: Arc) -> None:
        """Report each waiting ARC that is entitled to start before this one and starts later because of it."""
        replay, world = self._replay, self._world
        group = world.group_of(arc)
        first = [other for other in group if other.phase is Phase.WAITING and self._goes_before(other, arc)]
        if first:
            before = Plan(world, group, replay.now_s).starts
            after = Plan(world, group, replay.now_s, starting=arc).starts
            for other in first:
                if after[other] > before[other] + replay.slack_s:
                    self._harms(arc, other, before[other])
        if replay.strict:
            for other in group:
                if other.phase is Phase.WAITING and world.is_higher(other, arc) and world.is_usable(other):
                    replay.report("STRICT", arc.name, f"starts although the higher {other.name} waits")

    def _goes_before(self, other: Arc, arc: Arc) -> bool:
        """Whether the other one is higher, or an older equal, and the two cannot run at the same time."""
        replay, world = self._replay, self._world
        if other is arc or world.is_higher(arc, other) or not world.conflict(other, arc):
            return False
        if not world.is_higher(other, arc):
            older = other.rank[0] < arc.rank[0] - replay.slack_s
            if not older or replay.discipline == "time":
                return False
        return not (replay.strict and self._is_held_back(other))

    def _is_held_back(self, arc: Arc) -> bool:
        """Whether the strict policy forbids it to start: a higher usable ARC of its group waits."""
        world = self._world
        return any(
            other.phase is Phase.WAITING and world.is_higher(other, arc) and world.is_usable(other)
            for other in world.group_of(arc)
        )

    def _harms(self, arc: Arc, other: Arc, start_s: float) -> None:
        replay = self._replay
        if not self._world.is_higher(other, arc):
            replay.report("DELAY", arc.name, f"{other.name} is older and was to start at {start_s:.3f}")
        elif start_s <= replay.now_s + replay.tolerance_s:
            replay.report("PRIO", arc.name, f"starts although the higher {other.name} can start")
        else:
            replay.report("FUTILE", arc.name, f"the higher {other.name} is due at {start_s:.3f}")

    def revokes(self, arc: Arc) -> None:
        """Report an end that no entitled ARC needs; reserve what is freed by force for the ARC it is freed for."""
        replay, world = self._replay, self._world
        if not arc.wants or not all(world.rcs[rc].up for rc in arc.uses) or self._is_over_capacity():
            return
        group, soon_s = world.group_of(arc), replay.now_s + replay.slack_s
        starts = Plan(world, group, replay.now_s, revoked_are_free=True).starts
        due = [other for other in starts if other.phase is Phase.WAITING and starts[other] <= soon_s]
        rivals = [other for other in starts if other.phase is Phase.WAITING and self._need_the_same(other, arc, due)]
        over = arc.phase is Phase.RUNNING and arc.slice_end_s(replay.now_s) <= soon_s
        entitled = [
            other
            for other in rivals
            if starts[other] <= soon_s and (world.is_higher(other, arc) or (over and not world.is_higher(arc, other)))
        ]
        if not entitled:
            self._report_end(arc, rivals)
        forced = [other for other in entitled if world.is_higher(other, arc)]
        if forced and not arc.is_served(replay.now_s, INSTANT_S):
            forced[0].freed_for = forced[0].freed_for or (-1.0, replay.number)
            world.forget_groups()

    def _report_end(self, arc: Arc, rivals: list[Arc]) -> None:
        replay, world = self._replay, self._world
        without = Plan(world, world.group_of(arc), replay.now_s, revoked_are_free=True, gone=arc).starts
        gains = [other for other in rivals if without[other] <= replay.now_s + replay.slack_s]
        left_s = arc.slice_end_s(replay.now_s) - replay.now_s
        if any(not world.is_higher(arc, other) for other in gains):
            replay.report("MINRUN", arc.name, f"ends {left_s:.3f} s before its slice is over, for an equal ARC")
        elif gains:
            replay.report("DEMOTE", arc.name, f"ends for the lower {gains[0].name}")
        elif left_s > replay.slack_s:
            replay.report("MINRUN", arc.name, f"ends {left_s:.3f} s before its slice is over, for no ARC")
        elif not replay.strict:  # under the strict policy the plan cannot say who starts
            replay.report("SPURIOUS", arc.name, "ends, and no waiting ARC can start")

    def _is_over_capacity(self) -> bool:
        world = self._world
        return any(not world.fits(rc, world.keepers(rc)) for rc in world.rcs if world.rcs[rc].holders)

    def _need_the_same(self, other: Arc, arc: Arc, due: list[Arc]) -> bool:
        """Whether they share an RC, and the other cannot run beside all that run or are about to.

        All or nothing: which of the RCs keeps it from running is not asked.
        """
        world = self._world
        if not other.uses.keys() & arc.uses.keys():
            return False
        if world.conflict(other, arc):
            return True
        return not all(
            world.fits(rc, [other, *world.keepers(rc)])
            and world.fits(rc, {other, *world.keepers(rc), *(one for one in due if rc in one.uses)})
            for rc in other.uses
        )

    def new_slice(self, arc: Arc) -> None:
        """Report a new slice of an ARC beside which no equal starts or ends."""
        replay, world = self._replay, self._world
        if replay.now_s < arc.slice_end_s(replay.now_s) - replay.slack_s:
            replay.report("FORM", arc.name, f"a new slice before {arc.slice_end_s(replay.now_s):.3f}")
        beside = [other for other in world.group_of(arc) if other is not arc and other.uses.keys() & arc.uses.keys()]
        if not any(world.are_equal(other, arc) and self._comes_or_goes(other) for other in beside):
            replay.report("SPURIOUS", arc.name, "a new slice, and no equal ARC starts or ends beside it")

    def _comes_or_goes(self, arc: Arc) -> bool:
        earliest_s = self._replay.now_s - self._replay.slack_s
        if arc.phase is Phase.REVOKING:
            return arc.revoke_s >= earliest_s
        return arc.phase is Phase.CONNECTING and arc.connect_s >= earliest_s

    def time_passes(self, until_s: float) -> None:
        """Report each ARC that could start and is left waiting until this time."""
        now_s = self._replay.now_s
        for group in self._world.groups():
            waiting = [arc for arc in group if arc.phase is Phase.WAITING]
            if not waiting:
                continue
            ends_s = {arc.slice_end_s(now_s) for arc in group if arc.phase is Phase.RUNNING}
            moments_s = [now_s, *sorted(end_s for end_s in ends_s if now_s + INSTANT_S < end_s < until_s - INSTANT_S)]
            for moment_s, next_s in zip(moments_s, [*moments_s[1:], until_s], strict=True):
                self._look(group, waiting, moment_s, next_s)

    def _look(self, group: list[Arc], waiting: list[Arc], now_s: float, until_s: float) -> None:
        replay = self._replay
        starts = Plan(self._world, group, now_s).starts
        for arc in waiting:
            if starts[arc] > now_s + INSTANT_S or self._must_wait(arc, group, waiting, now_s):
                arc.due_s = None
                continue
            if arc.due_s is None:
                arc.due_s, arc.is_reported = now_s, False
            if until_s - arc.due_s > replay.slack_s and not arc.is_reported:
                arc.is_reported = True
                self._report_wait(arc, arc.due_s)

    def _must_wait(self, arc: Arc, group: list[Arc], waiting: list[Arc], now_s: float) -> bool:
        """Whether the ARC may be left waiting although its plan says now."""
        replay, world = self._replay, self._world
        if self._is_handed_over(arc, group, waiting) or (replay.strict and self._is_held_back(arc)):
            return True
        if replay.discipline == "time" and not self._starts_as_the_last(arc, group, now_s):
            return True
        if replay.relaxed and self._is_reserved(arc, group, waiting, now_s):
            return True
        exactly_s = Plan(world, group, now_s, longer=(arc, 2 * replay.tolerance_s)).starts[arc]
        return exactly_s > now_s + INSTANT_S

    def _is_handed_over(self, arc: Arc, group: list[Arc], waiting: list[Arc]) -> bool:
        """Whether RCs of the ARC, or of a rival of it, are about to be free."""
        going = [other.uses.keys() for other in group if other.phase is Phase.REVOKING]
        return any(
            uses & arc.uses.keys()
            or any(uses & one.uses.keys() and one.uses.keys() & arc.uses.keys() for one in waiting)
            for uses in going
        )

    def _starts_as_the_last(self, arc: Arc, group: list[Arc], now_s: float) -> bool:
        """Whether it can start even if all its equals go before it: equal time says nothing of their order."""
        last = self._world.ranked_with_last(group, arc)
        return Plan(self._world, last, now_s, equals_stay=True).starts[arc] <= now_s + INSTANT_S

    def _is_reserved(self, arc: Arc, group: list[Arc], waiting: list[Arc], now_s: float) -> bool:
        """Whether a rival that is not lower can be due within its run, as far as those that run now say."""
        replay, world = self._replay, self._world
        end_s = now_s + arc.length_s + 2 * replay.tolerance_s
        for other in waiting:
            if other is arc or world.is_higher(arc, other) or not other.uses.keys() & arc.uses.keys():
                continue
            if world.is_usable(other) and now_s < Plan(world, group, now_s).free_s(other) < end_s:
                return True
        return False

    def _report_wait(self, arc: Arc, since_s: float) -> None:
        replay, world = self._replay, self._world
        in_the_way = self._in_the_way(arc)
        names = ", ".join(other.name for other in in_the_way)
        if not in_the_way:
            replay.report("WC", arc.name, f"waits since {since_s:.3f}, and its RCs are free")
        elif any(world.is_higher(arc, other) for other in in_the_way):
            replay.report("PRIO", arc.name, f"waits since {since_s:.3f} for the lower of {names}")
        else:
            replay.report("RR", arc.name, f"waits since {since_s:.3f} for {names}, whose slices are over")

    def _in_the_way(self, arc: Arc) -> list[Arc]:
        """Return the ARCs that cannot run beside it; if each could, all that cannot together."""
        world = self._world
        beside = {other: None for rc in arc.uses for other in world.keepers(rc)}
        alone = [other for other in beside if world.conflict(arc, other)]
        if alone or all(world.fits(rc, [arc, *world.keepers(rc)]) for rc in arc.uses):
            return alone
        return list(beside)
