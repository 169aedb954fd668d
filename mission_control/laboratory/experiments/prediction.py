"""Prediction from geometry alone: simulates schedule phases, views, settling and a detector's frames many times.

Pure; no component runs, no picture is drawn. It uses only documented properties of the system: slices in turn or equal
time, settling, the blind frames of a detector after each context switch, the number of certain frames, the extension of
a slice at a glimpse, and bursts of bad frames.

Source: SCHEDULING.md, section 6: a trial's outcome depends on the phase between target and schedule, the order of
slots, the duration of each view, the settling time of a picture and the number of frames that the detector needs. Its
rule 13: equal time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from random import Random
from statistics import fmean

from mission_control.behaviors.run_times import RunTimes
from mission_control.behaviors.watch_for_motion import WatchParameters, frames_s, run_times
from mission_control.laboratory.experiments.conditions import Condition
from mission_control.laboratory.experiments.geometry import (
    FRAME_RATE_HZ,
    SETTLING_S,
    WATCHERS,
    Interval,
    Point,
    in_view,
    shortest_view_s,
)
from mission_control.laboratory.experiments.operator import DrivePhases
from mission_control.vision.motion_detection import FAST_FRAMES, VOTERS, VOTES

SAMPLES = 2000  # chosen: a standard error of 1 %, a third of that of 200 trials
BAD_SHARE, BAD_BURST_S = 0.25, 0.15  # SCHEDULING.md, section 6, at noise 1
LEAST_M = 0.05  # measured: a region reaches the least size with 0.01 to 0.08 m of a target in view
DRIVE_S = 5.0  # from the consoles' parameters
TOLERANCE_S = 0.05  # SCHEDULING.md, section 5: smaller differences of time are ignored


@lru_cache(maxsize=256)
def predicted(condition: Condition, samples: int = SAMPLES) -> float:
    """Return the share of detected passages under this condition; the same at each call."""
    dice = Random(f"prediction {samples}")
    return sum(_is_detected(condition, dice) for _ in range(samples)) / samples


def watcher_parameters(condition: Condition, watcher: Point) -> WatchParameters:
    """Return the parameters of a behavior that watches from this place."""
    if condition.policy == "paper":
        return WatchParameters(frames_wanted=condition.frames_wanted)
    return WatchParameters(
        frames_wanted=condition.frames_wanted,
        view_s=round(shortest_view_s(condition.passage, watcher), 2),
        settling_s=SETTLING_S,
        frame_rate_hz=FRAME_RATE_HZ,
    )


def departs_s(condition: Condition, phase: float) -> float:
    """Return the target's departure after the begin of the schedule's first turn, seconds.

    Slices in turn: within the first round. Equal time: within a round that begins half a round after the first turn,
    when drawn run times have come apart.

    Args:
        phase: Phase, 0 to 1, of a round; in a round each claimant has one slice, or as many as make the times equal.
    """
    asked_s = [fmean((times.shortest_s, times.longest_s)) for times in _asked(condition)]
    longest_s = max(asked_s)
    if condition.policy == "paper":
        return phase * sum(one_s + SETTLING_S for one_s in asked_s)
    return (0.5 + phase) * sum(longest_s / one_s * (one_s + SETTLING_S) for one_s in asked_s)


class Bursts:
    """Bursts of bad frames: a Markov chain of two states with the given share and mean length of bad frames."""

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


@lru_cache(maxsize=256)
def _asked(condition: Condition) -> Sequence[RunTimes]:
    """Return the run times of watchers and consoles, in the order of their first turns."""
    return tuple(_run_times(condition))


def _run_times(condition: Condition) -> Iterator[RunTimes]:
    for robot in condition.in_turn:
        parameters = None
        if robot in condition.watching:
            parameters = watcher_parameters(condition, WATCHERS[condition.watching.index(robot)])
        if parameters is not None and parameters.view_s > 0:
            yield run_times(parameters, condition.slice_s)
        else:
            asked_s = condition.slice_s if parameters is not None else condition.console_slice_s
            yield RunTimes(asked_s, asked_s, asked_s)


@dataclass(slots=True)
class _Claimant:
    times: RunTimes
    asks_s: float
    stamp: tuple[float, int]
    views: Sequence[Interval] = ()
    phases: DrivePhases | None = None
    changes_s: float = math.inf
    had_s: float = 0.0

    @property
    def wants(self) -> bool:
        return self.phases is None or self.phases.is_driving

    def sees_target(self, at_s: float) -> bool:
        for begin_s, over_s in self.views:  # noqa: SIM110  any() takes three times as long
            if begin_s <= at_s <= over_s:
                return True
        return False


@dataclass(slots=True)
class _Slice:
    """A slice from its grant on, with the state of a watcher's detector."""

    longest_until_s: float
    frames: int = 0
    certain: int = 0
    votes: deque[bool] = field(default_factory=lambda: deque(maxlen=VOTERS))

    def look(self, is_seen: bool, is_bad: bool) -> None:
        """Process one frame."""
        self.frames += 1
        if self.frames > FAST_FRAMES and not is_bad:
            self.votes.append(is_seen)
            self.certain += is_seen and sum(self.votes) >= VOTES

    def missing(self, wanted: int) -> int:
        """Return the number of missing certain or nearly certain frames; 0 without a glimpse."""
        if not self.votes or not self.votes[-1]:
            return 0
        return max(0, VOTES - 1 - sum(self.votes)) + wanted - self.certain


def _is_detected(condition: Condition, dice: Random) -> bool:
    """Simulate a passage at a random phase; return whether it is detected."""
    departs = departs_s(condition, dice.random())
    bursts = Bursts(condition.noise, dice)
    channels: list[list[_Claimant]] = [[] for _ in range(condition.channels)]
    for number, (robot, times) in enumerate(zip(condition.in_turn, _asked(condition), strict=True)):
        one = _Claimant(times, times.drawn_s(dice), (0.0, number))
        if robot in condition.watching:
            place = WATCHERS[condition.watching.index(robot)]
            views = in_view(condition.passage, place, least_m=LEAST_M)
            one.views = [(begin_s + departs, end_s + departs) for begin_s, end_s in views]
        elif condition.policy == "adaptive":
            one.phases = DrivePhases(dice.randrange(2**31), condition.driven, DRIVE_S)
            one.changes_s = one.phases.next_change_s()
        min(channels, key=len).append(one)
    over_s = departs + condition.passage.lasts_s
    return any(_Channel(condition, claimants, bursts, dice).detects(over_s) for claimants in channels)


class _Channel:
    """A video frequency and its claimants."""

    def __init__(self, condition: Condition, claimants: list[_Claimant], bursts: Bursts, dice: Random) -> None:
        self._condition, self._claimants, self._bursts, self._dice = condition, claimants, bursts, dice
        self._parameters = WatchParameters(frames_wanted=condition.frames_wanted)
        self._running: _Claimant | None = None
        self._slice = _Slice(0.0)
        self._served = len(claimants)

    def detects(self, over_s: float) -> bool:
        """Run the claimants until this time, one after the other; return whether one of them detects the target."""
        now_s = 0.0
        while now_s < over_s:
            self._catch_up(now_s)
            rivals = [one for one in self._claimants if one.wants]
            if not rivals:
                now_s = min(one.changes_s for one in self._claimants)
                continue
            chosen = self._senior(rivals, now_s) if now_s else rivals[0]
            asked_s = chosen.asks_s
            if chosen is not self._running:
                self._served += 1
                if self._running is not None:
                    self._running.stamp = (now_s, self._served)
                now_s += SETTLING_S
                self._running, self._slice = chosen, _Slice(now_s + chosen.times.maximum_s)
                chosen.asks_s = chosen.times.drawn_s(self._dice)
            end_s = now_s + asked_s
            if chosen.phases is not None:
                end_s = min(end_s, max(now_s, chosen.changes_s))
            elif chosen.views:
                end_s, is_certain = self._watch(chosen, now_s, end_s)
                if is_certain:
                    return True
            chosen.had_s += end_s - now_s
            now_s = end_s
        return False

    def _senior(self, rivals: Sequence[_Claimant], now_s: float) -> _Claimant:
        late_s = fmean([rival.had_s for rival in rivals]) + TOLERANCE_S
        return min(rivals, key=lambda one: self._seniority(one, late_s, now_s))

    def _seniority(self, one: _Claimant, late_s: float, now_s: float) -> tuple[bool, float, float, int]:
        """Return the sort key among equals, smallest first. After its slice a claimant goes behind its equals.

        Args:
            late_s: Time that a claimant may have had before it counts as late.
        """
        is_running = one is self._running
        stamp = (now_s, 0) if is_running else one.stamp
        if self._condition.policy == "paper":
            return (False, 0.0, *stamp)
        is_late = one.had_s > late_s
        deadline_s = one.had_s + one.asks_s + (TOLERANCE_S if is_running else 0.0)
        return (is_late, round(deadline_s, 6), *stamp)

    def _catch_up(self, now_s: float) -> None:
        """Apply the consoles' changes of phase until now; a returning console has no credit for its rest."""
        for one in self._claimants:
            while one.phases is not None and one.changes_s <= now_s:
                one.phases.change()
                one.changes_s += one.phases.next_change_s()
                if one.phases.is_driving:
                    others_s = [other.had_s for other in self._claimants if other is not one and other.wants]
                    one.had_s = max(one.had_s, fmean(others_s)) if others_s else one.had_s
                    self._served += 1
                    one.stamp = (now_s, self._served)
                elif one is self._running:
                    self._running = None

    def _watch(self, one: _Claimant, now_s: float, end_s: float) -> tuple[float, bool]:
        """Return the end of the slice, and whether the watcher is certain of the target."""
        frame_s = now_s + self._dice.random() / FRAME_RATE_HZ
        wanted, of_slice, bursts = self._condition.frames_wanted, self._slice, self._bursts
        while frame_s < end_s:
            of_slice.look(one.sees_target(frame_s), bursts.next_is_bad())
            if of_slice.certain >= wanted:
                return end_s, True
            missing = of_slice.missing(wanted)
            if missing:
                wish_s = min(frame_s + frames_s(self._parameters, missing + 1), of_slice.longest_until_s)
                end_s = max(end_s, wish_s)
            frame_s += 1.0 / FRAME_RATE_HZ
        return end_s, False
