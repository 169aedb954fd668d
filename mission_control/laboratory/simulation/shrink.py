"""Shrinker: reduces the faults of a broken run to a small set that breaks the same law.

Source: Zeller and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", IEEE Transactions on
Software Engineering 28(2), 2002: algorithm ddmin, by complements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")

MOST_TRIALS = 300  # chosen: at five to ten runs a second, a minute at most


def smallest(causes: Sequence[T], breaks: Callable[[Sequence[T]], bool], most_trials: int = MOST_TRIALS) -> list[T]:
    """Return a subset of the causes, in their order, that still breaks the law.

    Unless the trials were used up, no cause of the result can be left out.

    Args:
        causes: Causes that break the law together.
        breaks: Returns whether a subset breaks the law; deterministic.
        most_trials: Largest number of calls.

    Example:
        >>> smallest([1, 2, 3, 4, 5, 6], lambda some: {2, 5} <= {*some})
        [2, 5]
    """
    left, parts, trials = list(causes), 2, 0
    if left and breaks([]):
        return []
    while len(left) > 1:
        size = -(-len(left) // parts)
        for begin in range(0, len(left), size):
            if trials == most_trials:
                return left
            trials += 1
            rest = left[:begin] + left[begin + size :]
            if breaks(rest):
                left, parts = rest, max(2, parts - 1)
                break
        else:
            if size == 1:
                return left
            parts = min(len(left), 2 * parts)
    return left
