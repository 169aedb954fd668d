"""Prefix maximum: the largest value among the paths that are higher than a path, without comparing all pairs.

Two paths part at siblings, so it suffices to know the numbers of each node's children.
"""

from __future__ import annotations

import math

from backbone.scheduling.priority import Path

OWN = math.inf  # a node's own request counts as a child with the largest number, because it is above all children


class PrefixMaximum:
    """Values of paths; the largest value of those higher than a path is found in a few steps."""

    def __init__(self) -> None:
        self._largest: dict[tuple[str, ...], dict[float, float]] = {}

    def add(self, path: Path, value: float) -> None:
        """Add a path with a value.

        Example:
            >>> above = PrefixMaximum()
            >>> above.add((("m", 0), ("left", 2)), 7.0)
            >>> above.largest((("m", 0), ("right", 1))), above.largest((("m", 0), ("right", 2)))
            (7.0, -inf)
        """
        names: tuple[str, ...] = ()
        for name, number in (*path, ("", OWN)):
            largest = self._largest.setdefault(names, {})
            largest[number] = max(value, largest.get(number, -math.inf))
            names = (*names, name)

    def largest(self, path: Path) -> float:
        """Return the largest value among the paths higher than this one; minus infinity if there is none."""
        found = -math.inf
        names: tuple[str, ...] = ()
        for name, number in path:
            values = self._largest.get(names, {})
            found = max([found, *(value for other, value in values.items() if other > number)])
            names = (*names, name)
        return found
