"""How long an ARC waits and how often it runs, compared with its equals: FAIR, TURNS, SHARE.

These bounds hold among ARCs that were equals all the time. Nothing is stated of a wait that an RC's fault, another
capacity or another priority came before, and nothing of turns in a mission that had one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import TYPE_CHECKING, NamedTuple

from .plan import INSTANT_S
from .priority_order import connected
from .state import Arc, Phase

if TYPE_CHECKING:
    from .replay import Replay

REACTIONS = 4  # chosen: revoke, free, connect and grant each come up to the tolerance late


class Wait(NamedTuple):
    """A time in which an ARC waited."""

    arc: Arc
    begin_s: float
    end_s: float


class Fairness:
    """Notes all waits, grants and slices; states the bounds when the trace is over."""

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._waits: list[Wait] = []
        self._grants: list[tuple[float, str]] = []
        self._disturbed_s = inf

    def disturbed(self) -> None:
        """From now on no bound holds."""
        self._disturbed_s = min(self._disturbed_s, self._replay.now_s)

    def becomes_active(self, arc: Arc) -> None:
        arc.active_s.append((self._replay.now_s, inf))

    def becomes_inactive(self, arc: Arc) -> None:
        if arc.active_s and arc.active_s[-1][1] == inf:
            arc.active_s[-1] = (arc.active_s[-1][0], self._replay.now_s)

    def waited(self, arc: Arc) -> None:
        self._waits.append(Wait(arc, arc.since_s, self._replay.now_s))

    def granted(self, arc: Arc) -> None:
        self._grants.append((self._replay.now_s, arc.name))

    def ran(self, arc: Arc) -> None:
        arc.services.append((arc.begin_s, self._replay.now_s))

    def over(self) -> None:
        """Report all waits, turns and times that exceed their bounds."""
        for arc in self._replay.world.arcs.values():
            if arc.phase is Phase.WAITING:
                self.waited(arc)
        for wait in self._waits:
            if wait.end_s < self._disturbed_s - INSTANT_S:
                self._compare_with_bound(wait)
        if self._disturbed_s == inf:
            for group in connected(list(self._replay.world.arcs.values()), lambda arc: arc.uses):
                self._compare_rivals(group)

    def _compare_with_bound(self, wait: Wait) -> None:
        world = self._replay.world
        arc = world.arcs[wait.arc.name]
        if not world.is_usable(arc):
            return
        beside = [other for other in world.arcs.values() if _was_active(other, wait)]
        group = next((group for group in connected(beside, lambda one: one.uses) if arc in group), [arc])
        if not self._are_all_equal(group) or any(one.moved_s <= wait.end_s for one in group):
            return
        waited_s, bound_s = wait.end_s - wait.begin_s, self._bound_s(arc, group)
        if waited_s > bound_s + INSTANT_S:
            self._report("FAIR", wait.end_s, arc, f"waited {waited_s:.3f} s, bound {bound_s:.3f} s")

    def _are_all_equal(self, group: Sequence[Arc]) -> bool:
        return not any(self._replay.world.is_higher(one, other) for one in group for other in group)

    def _switch_s(self, arc: Arc) -> float:
        replay = self._replay
        return arc.settle_s + arc.release_s + replay.grace_s + REACTIONS * replay.tolerance_s

    def _bound_s(self, arc: Arc, group: list[Arc]) -> float:
        """Return how long it may wait: for a turn of each other one, and for its own switch."""
        replay = self._replay
        others = [other for other in group if other is not arc]
        if replay.discipline == "turns":
            turns_s = sum(other.max_run_s + self._switch_s(other) for other in others)
            return turns_s + arc.settle_s + replay.grace_s + replay.tolerance_s
        longest_s = max(one.max_run_s for one in group)
        lag_s = 0.0  # each other one may first catch up by what it lags behind
        for other in others:
            lag_s += (arc.max_run_s + other.max_run_s + longest_s) * (1 + self._switch_s(other) / other.min_run_s)
        return lag_s + self._switch_s(arc)

    def _report(self, code: str, time_s: float, arc: Arc, message: str) -> None:
        self._replay.now_s = time_s
        self._replay.report(code, arc.name, message)

    def _compare_rivals(self, group: list[Arc]) -> None:
        """Compare those that were active from their first request on, if all of the group exclude each other."""
        world = self._replay.world
        if not self._are_all_equal(group) or any(one.moved_s < inf for one in group):
            return
        if not all(one is other or world.conflict(one, other) for one in group for other in group):
            return
        always = [arc for arc in group if len(arc.active_s) == 1 and arc.active_s[0][1] == inf]
        if len(always) < 2:
            return
        begin_s = max(arc.active_s[0][0] for arc in always)
        if self._replay.discipline == "turns":
            self._compare_turns(always, begin_s)
        else:
            self._compare_times(always, begin_s)

    def _compare_turns(self, always: list[Arc], begin_s: float) -> None:
        turns = dict.fromkeys((arc.name for arc in always), 0)
        for time_s, name in self._grants:
            if name not in turns or time_s < begin_s:
                continue
            turns[name] += 1
            if max(turns.values()) > min(turns.values()) + 1:
                self._report("TURNS", time_s, self._replay.world.arcs[name], f"turns {turns}")
                return

    def _compare_times(self, always: list[Arc], begin_s: float) -> None:
        ends_s = sorted(end_s for arc in always for _, end_s in arc.services if end_s > begin_s)
        longest_s = max(arc.max_run_s for arc in always)
        for now_s in ends_s:
            had_s = {arc: _had_s(arc, begin_s, now_s) for arc in always}
            most, least = max(always, key=had_s.__getitem__), min(always, key=had_s.__getitem__)
            limit_s = most.max_run_s + least.max_run_s + longest_s + REACTIONS * self._replay.tolerance_s
            if had_s[most] - had_s[least] > limit_s:
                message = f"{most.name} had {had_s[most]:.3f} s, this one {had_s[least]:.3f} s since {begin_s:.3f}"
                self._report("SHARE", now_s, least, message)
                return


def _was_active(arc: Arc, wait: Wait) -> bool:
    return any(begin_s <= wait.end_s and end_s >= wait.begin_s for begin_s, end_s in arc.active_s)


def _had_s(arc: Arc, since_s: float, until_s: float) -> float:
    """Return how long it ran within this time, slices that were not over left out."""
    return sum(
        min(end_s, until_s) - max(begin_s, since_s)
        for begin_s, end_s in arc.services
        if end_s > since_s and begin_s < until_s
    )
