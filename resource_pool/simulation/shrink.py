"""From all faults of a broken run to as few as still break the same law.

Source: Zeller and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", IEEE Transactions on
Software Engineering 28(2), 2002: algorithm ddmin, by complements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")

MOST_TRIALS = 300  # chosen: at five to ten runs a second, the time a person waits for an answer


def smallest(causes: Sequence[T], breaks: Callable[[Sequence[T]], bool], most_trials: int = MOST_TRIALS) -> list[T]:
    """Return some of the causes, in their order, that together still break it.

    Of what is returned no single one can be left out, unless the trials were used up before.

    Args:
        causes: They all together break it.
        breaks: Says whether some of them do; must give the same answer for the same causes.
        most_trials: How often it may be asked.

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
