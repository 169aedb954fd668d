"""How many examples a law is tried with: all of them in CI, a share in a run that a person waits for."""

from __future__ import annotations

from hypothesis import settings

FULL = 100  # what the profile "full" has
FEWEST = 3  # chosen: a law is tried with more than one example


def share(count: int) -> int:
    """Return how many of so many examples the profile of this run tries.

    The laws of scheduling are always tried with all: the planted faults are caught by them.
    """
    return max(min(count, FEWEST), count * min(settings.default.max_examples, FULL) // FULL)
