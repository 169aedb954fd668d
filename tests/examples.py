"""How many examples a law is tried with: all of them in CI, a share in a run that a person waits for."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any, TypeVar

import pytest
from hypothesis import settings

Case = TypeVar("Case")

FULL = 100  # what the profile "full" has
FEWEST = 2  # chosen: a law is tried with more than one example


def share(count: int) -> int:
    """Return how many of so many examples the profile of this run tries."""
    return max(min(count, FEWEST), count * min(settings.default.max_examples, FULL) // FULL)


def rest_thorough(cases: Iterable[Any], quick: int = 1) -> list[Any]:
    """Return the cases of a test for which the first few say nearly all: the others are marked ``thorough``."""
    values = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*value, marks=[pytest.mark.thorough] * (at >= quick)) for at, value in enumerate(values)]


def some(cases: Iterable[Case]) -> list[Case]:
    """Return the cases that the profile of this run tries: all of them in CI, else a share from all over them.

    From one part of the list the first is taken, from the next the second, so that of a product no factor stays out.
    """
    every = list(cases)
    parts = pairwise(part * len(every) // share(len(every)) for part in range(share(len(every)) + 1))
    return [every[start + number % (end - start)] for number, (start, end) in enumerate(parts)]
