"""How many examples a law is tried with: all of them in CI, a share in a run that a person waits for."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TypeVar

from hypothesis import settings

Case = TypeVar("Case")

FULL = 100  # what the profile "full" has
FEWEST = 3  # chosen: a law is tried with more than one example


def share(count: int) -> int:
    """Return how many of so many examples the profile of this run tries."""
    return max(min(count, FEWEST), count * min(settings.default.max_examples, FULL) // FULL)


def some(cases: Iterable[Case]) -> list[Case]:
    """Return the cases that the profile of this run tries: all of them in CI, else a share from all over them.

    From one part of the list the first is taken, from the next the second, so that of a product no factor stays out.
    """
    every = list(cases)
    parts = pairwise(part * len(every) // share(len(every)) for part in range(share(len(every)) + 1))
    return [every[start + number % (end - start)] for number, (start, end) in enumerate(parts)]
