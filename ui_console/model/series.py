"""Series: a number over time, as a plot of any width shows it. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

SPAN_S = 60.0  # chosen: as much as the timeline of the resources
PARTS = 240  # chosen: two for each column of a wide terminal


class Extent(NamedTuple):
    """The numbers of a part of time."""

    least: float
    most: float


class Series:
    """The least and most numbers in each part of the last minute, however many came.

    Args:
        span_s: How much of the past is kept, mission seconds.
    """

    def __init__(self, span_s: float = SPAN_S) -> None:
        self.span_s = span_s
        self._part_s = span_s / PARTS
        self._parts: dict[int, Extent] = {}
        self._last = -math.inf
        self.newest: float | None = None
        """The last number; None: there was none."""

    def __len__(self) -> int:
        return len(self._parts)

    def add(self, at_s: float, number: float) -> None:
        """Take in a number; one that is not finite, or older than the span, is left out."""
        if not (math.isfinite(number) and math.isfinite(at_s)):
            return
        part = math.floor(at_s / self._part_s)
        if part <= self._last - PARTS:
            return
        before = self._parts.get(part, Extent(number, number))
        self._parts[part] = Extent(min(before.least, number), max(before.most, number))
        if part >= self._last:
            self._last, self.newest = part, number
            for old in [one for one in self._parts if one <= part - PARTS]:
                del self._parts[old]

    def columns(self, now_s: float, count: int) -> list[Extent | None]:
        """Return the extents in so many equal parts of the span that ends now, oldest first; None: no number came."""
        found: list[Extent | None] = [None] * count
        now = math.floor(now_s / self._part_s)
        for part, extent in self._parts.items():
            column = (part - now + PARTS - 1) * count // PARTS
            if 0 <= column < count:
                there = found[column] or extent
                found[column] = Extent(min(there.least, extent.least), max(there.most, extent.most))
        return found

    def levels(self, now_s: float, count: int) -> list[float]:
        """Return a number for each column: its most, or the one before where none came; none before the first.

        A number holds until the next one comes, so a line through these is what was known at each time.
        """
        shown: list[float] = []
        for extent in self.columns(now_s, count):
            if extent is not None:
                shown.append(extent.most)
            elif shown:
                shown.append(shown[-1])
        return shown

    def extent(self, now_s: float) -> Extent | None:
        """Return the least and most numbers of the span; None: no number came."""
        there = [one for one in self.columns(now_s, PARTS) if one is not None]
        return Extent(min(one.least for one in there), max(one.most for one in there)) if there else None
