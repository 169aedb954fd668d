"""Fairness: the order among equals (rule 13).

* ``turns``: the ARC that waits longest since it became active or was last served comes first. Each gets its own minimum
  run time in turn.
* ``time``: the ARC with the least run time comes first. Each ARC has a virtual deadline for its next minimum run time.
  Of the ARCs that had no more than the average of their rivals, the one with the earliest deadline comes first. An ARC
  with short slices is served more often, not longer.

Rule of this file: pure; the rivals and the time are arguments.

Source: IROS 2001, "RC manager" (turns). Stoica and Abdel-Wahab, "Earliest Eligible Virtual Deadline
First", 1995 (time).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from statistics import fmean
from typing import Literal, Protocol

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.requests import RequestState

Discipline = Literal["turns", "time"]

Seniority = tuple[bool, float, float, int]
"""Key among equals: smaller comes first."""

ROUNDING_S = 1e-6  # chosen: an ARC that is ahead of the average by no more than this is not ahead


class Fairness(Protocol):
    """A discipline among equals."""

    discipline: Discipline

    def seniority(self, arc: ArcEntry, now_s: float) -> Seniority:
        """Return the key of the ARC among its equals; ARCs with a reservation come first."""


class Turns:
    """Each ARC gets its own minimum run time in turn; no ARC has two turns in a row while equals wait."""

    discipline: Discipline = "turns"

    def seniority(self, arc: ArcEntry, now_s: float) -> Seniority:
        """Return its stamp."""
        del now_s
        return _of_reservation(arc) or (False, 0.0, *arc.stamp)


class EqualTime:
    """Equal time for rivals, earliest eligible virtual deadline first."""

    discipline: Discipline = "time"

    def __init__(self, rivals: Callable[[ArcEntry], list[ArcEntry]], tolerance_s: float) -> None:
        """Begin without run times.

        Args:
            rivals: ARC → its equals that cannot run beside it.
            tolerance_s: Inaccuracy of timers.
        """
        self._rivals = rivals
        self._tolerance_s = tolerance_s

    def seniority(self, arc: ArcEntry, now_s: float) -> Seniority:
        """Return three values: whether it had more than its rivals, its deadline, and its stamp."""
        reserved = _of_reservation(arc)
        if reserved:
            return reserved
        had_s = _had_s(arc, now_s)
        late = not eligible(had_s, self._others_had_s(arc, now_s), self._tolerance_s)
        if arc.state is RequestState.RUNNING:  # a rival with equal time, within the timers' accuracy, comes before it
            return (late, deadline_s(had_s, arc.minimum_s) + self._tolerance_s, now_s, 0)
        return (late, deadline_s(had_s, arc.minimum_s), *arc.stamp)

    def joined(self, arc: ArcEntry, now_s: float) -> None:
        """Set the run time of an ARC that joins, without credit for the time it was away."""
        arc.had_s = joining_s(arc.had_s, self._others_had_s(arc, now_s))

    def stopped(self, arc: ArcEntry, now_s: float) -> None:
        """Add the time since its grant to its run time, and limit the credit of rivals that could not run instead."""
        arc.had_s = _had_s(arc, now_s)
        for rival in self._rivals(arc):
            rival.had_s = max(rival.had_s, arc.had_s - arc.maximum_s - rival.maximum_s)

    def runs_on(self, arc: ArcEntry, waiting: Iterable[ArcEntry], now_s: float) -> bool:
        """Return whether it still precedes all rivals that wait, so that it may run on."""
        own, rivals = self.seniority(arc, now_s), {*self._rivals(arc)}
        keys = [self.seniority(other, now_s) for other in waiting if other in rivals]
        return bool(keys) and all(own < key for key in keys)

    def _others_had_s(self, arc: ArcEntry, now_s: float) -> list[float]:
        return [_had_s(other, now_s) for other in self._rivals(arc)]


def eligible(had_s: float, rivals_s: Iterable[float], tolerance_s: float = 0.0) -> bool:
    """Return whether an ARC with this run time may get more before its rivals.

    Args:
        had_s: Run time of the ARC.
        rivals_s: Run times of its rivals.
        tolerance_s: Inaccuracy of timers; an ARC is ahead only if it exceeds the average by more.
    """
    return had_s <= fmean([had_s, *rivals_s]) + max(ROUNDING_S, tolerance_s)


def joining_s(had_s: float, rivals_s: Iterable[float]) -> float:
    """Return the run time that a new or returning ARC starts with: no credit for the time it was away."""
    others = [*rivals_s]
    return max(had_s, fmean(others)) if others else had_s


def deadline_s(had_s: float, minimum_s: float) -> float:
    """Return the virtual deadline of its next minimum run time."""
    return had_s + minimum_s


def _had_s(arc: ArcEntry, now_s: float) -> float:
    return arc.had_s + (now_s - arc.granted_s if arc.state is RequestState.RUNNING else 0.0)


def _of_reservation(arc: ArcEntry) -> Seniority | None:
    return None if arc.reservation is None else (False, -math.inf, -math.inf, arc.reservation)
