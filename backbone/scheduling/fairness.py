"""Discipline among equals: which of those neither of which is higher comes first (rule 13).

* ``turns``: who waits longest since it came or was last served. Each gets its own minimum run time in turn.
* ``time``: who has had the least time. Each asks for one more minimum run time and has to have it by a
  virtual deadline; of those that have not had more than the average of their rivals, the earliest
  deadline comes first. Who asks for short slices is served more often, not longer.

Rule of this file: pure; who the rivals of an ARC are, others say.

Source: IROS 2001, "RC manager" (turns). Stoica and Abdel-Wahab, "Earliest Eligible Virtual Deadline
First", 1995 (time).
"""

from __future__ import annotations

from collections.abc import Iterable
from statistics import fmean
from typing import Literal

Discipline = Literal["turns", "time"]

ROUNDING_S = 1e-6  # chosen: who is ahead of the average by no more than this is not ahead


def eligible(had_s: float, rivals_s: Iterable[float], tolerance_s: float = 0.0) -> bool:
    """Say whether an ARC that had this much time may ask for more before its rivals.

    Args:
        had_s: Time it had.
        rivals_s: Times its rivals had.
        tolerance_s: By so much no timer is exact: who is ahead of the average by no more is not ahead.
    """
    return had_s <= fmean([had_s, *rivals_s]) + max(ROUNDING_S, tolerance_s)


def joining_s(had_s: float, rivals_s: Iterable[float]) -> float:
    """Return what an ARC that comes (again) counts as having had: no credit for the time it was away."""
    others = [*rivals_s]
    return max(had_s, fmean(others)) if others else had_s


def deadline_s(had_s: float, minimum_s: float) -> float:
    """Return the virtual time by which it has to have had one more minimum run time."""
    return had_s + minimum_s
