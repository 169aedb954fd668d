"""What the geometry alone promises: schedule phases, views, settling and the frames a detector needs, drawn many times.

Pure; no component runs, no picture is drawn. It knows of the system what stands in its documents: slices in turn
(or of equal time), their settling, the frames a detector is blind for after each swap, the certain frames wanted,
and that bad frames come in bursts.

Source: SCHEDULING.md, section 6: a trial's outcome depends on the phase between target and schedule, the order of
slots, the time each view lasts, the time a picture needs to settle and the frames the detector needs.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from random import Random

from mission_control.behaviors.run_times import useful_run_times
from mission_control.experiments.conditions import Condition
from mission_control.experiments.geometry import FRAME_RATE_HZ, SETTLING_S, WATCHERS, Interval, in_view
from mission_control.experiments.operator import Hands
from mission_control.vision.motion_detection import FAST_FRAMES, VOTERS, VOTES

SAMPLES = 2000  # chosen: a standard error of 1 %, a third of that of 200 trials
SWITCH_S = 0.002  # measured: the last packet of a hold
BAD_SHARE, BAD_BURST_S = 0.25, 0.15  # SCHEDULING.md, section 6, at noise 1
LEAST_M = 0.1  # measured: so much of a target must be in view before its region is large enough
CLEAN_SHARE = 0.75  # of the watchers' parameters
ADAPTED_SLICE_S = 1.25  # chosen: about what watchers work out; only the spread of phases depends on it
ASK_BEFORE_END_S = 0.2  # resource_pool.aggregate_resource_controller: when "not now" can be said


@lru_cache(maxsize=256)
def predicted(condition: Condition, samples: int = SAMPLES) -> float:
    """Return the share of passages that are detected, for this condition; the same at each call."""
    dice = Random(f"prediction {samples}")
    return sum(_Sample(condition, dice).is_detected() for _ in range(samples)) / samples


class Bursts:
    """Which frames are bad: a chain of two states with the wanted share and mean length of bad ones."""

    def __init__(self, noise: float, dice: Random) -> None:
        self._dice = dice
        share = min(0.9, 1.0 - math.pow(1.0 - BAD_SHARE, noise))
        self._ends = min(1.0, 1.0 / (BAD_BURST_S * FRAME_RATE_HZ))
        self._begins = self._ends * share / (1.0 - share)
        self.is_bad = dice.random() < share

    def next_is_bad(self) -> bool:
        """Return whether the next frame is bad."""
        self.is_bad = self._dice.random() < (1.0 - self._ends if self.is_bad else self._begins)
        return self.is_bad


@dataclass(slots=True)
class _Claimant:
    robot: str
    minimum_s: float
    maximum_s: float
    views: Sequence[Interval] = ()
    hands: Hands | None = None
    changes_s: float = math.inf
    had_s: float = 0.0
    since: int = 0

    @property
    def wants(self) -> bool:
        return self.hands is None or self.hands.is_driving


@dataclass(slots=True)
class _Watch:
    """One slice of a watcher: its detector's state."""

    wanted: int
    frames: int = 0
    certain: int = 0
    votes: deque[bool] = field(default_factory=lambda: deque(maxlen=VOTERS))

    def look(self, is_seen: bool, is_bad: bool) -> bool:
        """Take one frame; return whether there are enough certain ones now."""
        self.frames += 1
        if self.frames <= FAST_FRAMES or is_bad:
            return False
        self.votes.append(is_seen)
        self.certain += is_seen and sum(self.votes) >= VOTES
        return self.certain >= self.wanted


def departs_s(condition: Condition, phase: float) -> float:
    """Return when the target departs after the schedule's first turn began, seconds.

    Args:
        condition: What is tried.
        phase: 0 to 1, of a round: slices in turn, one of each; with equal time as many of each as make it equal.
    """
    watcher_s, console_s = condition.slice_s, condition.console_slice_s
    if condition.policy == "adaptive":
        watcher_s = min(watcher_s, ADAPTED_SLICE_S)
    switch_s = SETTLING_S + SWITCH_S
    most_s = max(watcher_s, console_s) if condition.extra else watcher_s
    if condition.policy == "paper":
        watching_s, driving_s = watcher_s + switch_s, console_s + switch_s
    else:
        watching_s, driving_s = (most_s / slice_s * (slice_s + switch_s) for slice_s in (watcher_s, console_s))
    round_s = condition.active * watching_s + condition.extra * driving_s
    first_s = 0.0 if condition.policy == "paper" else round_s / 2
    return first_s + phase * round_s


class _Sample:
    """One passage at a random phase."""

    def __init__(self, condition: Condition, dice: Random) -> None:
        self._condition, self._dice = condition, dice
        self._departs_s = departs_s(condition, dice.random())
        self._over_s = self._departs_s + condition.passage.lasts_s
        self._bursts = Bursts(condition.noise, dice)
        self._channels: list[list[_Claimant]] = [[] for _ in range(condition.channels)]
        for number, robot in enumerate(condition.in_turn):
            fewest = min(self._channels, key=len)
            fewest.append(self._claimant(robot, number))

    def is_detected(self) -> bool:
        return any(self._channel_detects(claimants) for claimants in self._channels)

    def _claimant(self, robot: str, number: int) -> _Claimant:
        condition = self._condition
        if robot in condition.watching:
            place = WATCHERS[condition.watching.index(robot)]
            views = [
                (b + self._departs_s, e + self._departs_s)
                for b, e in in_view(condition.passage, place, least_m=LEAST_M)
            ]
            least_s = most_s = condition.slice_s
            if condition.policy == "adaptive":
                view_s = min(e - b for b, e in in_view(condition.passage, place))
                times = useful_run_times(
                    view_s=view_s,
                    settling_s=SETTLING_S,
                    blind_s=FAST_FRAMES / FRAME_RATE_HZ,
                    detect_s=(VOTES - 1 + condition.frames_wanted) / (FRAME_RATE_HZ * CLEAN_SHARE),
                    given_s=condition.slice_s,
                )
                least_s, most_s = times.minimum_s, times.maximum_s
            return _Claimant(robot, least_s, most_s, views, since=number)
        if condition.policy == "paper":
            return _Claimant(robot, condition.slice_s, condition.slice_s, since=number)
        hands = Hands(self._dice.randrange(2**31), condition.driven, 5.0)
        asked_s = condition.console_slice_s
        return _Claimant(robot, asked_s, asked_s, hands=hands, changes_s=hands.next_change_s())

    def _channel_detects(self, claimants: list[_Claimant]) -> bool:
        now_s, served = 0.0, len(claimants)
        last: _Claimant | None = None
        watch: _Watch | None = None
        while now_s < self._over_s:
            for one in claimants:
                self._catch_up(one, now_s, claimants)
            waiting = [one for one in claimants if one.wants]
            if not waiting:
                now_s = min(one.changes_s for one in claimants)
                continue
            chosen = self._next(waiting)
            served += 1
            if chosen is not last:
                now_s += SETTLING_S
                watch = _Watch(self._condition.frames_wanted)
            last, begin_s = chosen, now_s
            end_s = now_s + chosen.minimum_s
            if chosen.hands is not None:
                end_s = min(end_s, max(now_s, chosen.changes_s))
            elif watch is not None and chosen.views:
                end_s, detected = self._watch(chosen, watch, now_s, end_s)
                if detected:
                    return True
            chosen.had_s += end_s - begin_s
            chosen.since = served
            now_s = end_s + SWITCH_S
        return False

    def _next(self, waiting: list[_Claimant]) -> _Claimant:
        if self._condition.policy == "paper":
            return min(waiting, key=lambda one: one.since)
        average_s = sum(one.had_s for one in waiting) / len(waiting) + 1e-6
        eligible = [one for one in waiting if one.had_s <= average_s]
        return min(eligible, key=lambda one: (one.had_s + one.minimum_s, one.since))

    def _catch_up(self, one: _Claimant, now_s: float, claimants: list[_Claimant]) -> None:
        while one.hands is not None and one.changes_s <= now_s:
            one.hands.change()
            one.changes_s += one.hands.next_change_s()
            if one.hands.is_driving:
                others = [other.had_s for other in claimants if other is not one and other.wants]
                one.had_s = max(one.had_s, sum(others) / len(others)) if others else one.had_s

    def _watch(self, chosen: _Claimant, watch: _Watch, begin_s: float, end_s: float) -> tuple[float, bool]:
        most_s = begin_s + chosen.maximum_s
        frame_s = begin_s + self._dice.random() / FRAME_RATE_HZ
        while frame_s < end_s:
            is_seen = any(b <= frame_s <= e for b, e in chosen.views)
            if watch.look(is_seen, self._bursts.next_is_bad()):
                return end_s, True
            frame_s += 1.0 / FRAME_RATE_HZ
            if end_s - ASK_BEFORE_END_S <= frame_s and end_s < most_s and any(watch.votes):
                missing = max(1, self._condition.frames_wanted - watch.certain)
                end_s = min(most_s, end_s + max(ASK_BEFORE_END_S, missing / (FRAME_RATE_HZ * CLEAN_SHARE)))
        return end_s, False
