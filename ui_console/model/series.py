"""Series: a number over time, for plots of any width. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

SPAN_S = 60.0  # chosen: as for the timeline of the resources
PARTS = 240  # chosen: two for each column of a wide terminal


class Extent(NamedTuple):
    """Smallest and largest number in a time slot."""

    least: float
    most: float


class Series:
    """Smallest and largest numbers in each slot of the last minute; bounded memory for any number of values.

    Args:
        span_s: Length of the kept past, mission seconds.
    """

    def __init__(self, span_s: float = SPAN_S) -> None:
        self.span_s = span_s
        self._part_s = span_s / PARTS
        self._parts: dict[int, Extent] = {}
        self._last = -math.inf

    def __len__(self) -> int:
        return len(self._parts)

    def add(self, at_s: float, number: float) -> None:
        """Record a number; a number that is not finite, or older than the span, is ignored."""
        if not (math.isfinite(number) and math.isfinite(at_s)):
            return
        part = math.floor(at_s / self._part_s)
        if part <= self._last - PARTS:
            return
        before = self._parts.get(part, Extent(number, number))
        self._parts[part] = Extent(min(before.least, number), max(before.most, number))
        if part >= self._last:
            self._last = part
            for old in [one for one in self._parts if one <= part - PARTS]:
                del self._parts[old]

    def columns(self, now_s: float, count: int) -> list[Extent | None]:
        """Return the extents of this many equal parts of the span until now, oldest first; None: an empty part."""
        found: list[Extent | None] = [None] * count
        now = math.floor(now_s / self._part_s)
        for part, extent in self._parts.items():
            column = (part - now + PARTS - 1) * count // PARTS
            if 0 <= column < count:
                there = found[column] or extent
                found[column] = Extent(min(there.least, extent.least), max(there.most, extent.most))
        return found

    def levels(self, now_s: float, count: int) -> list[float]:
        """Return a number for each column: its largest, or the previous one for an empty column; None at the begin.

        A number holds until the next one arrives, so a line through these shows the known value at each time.
        """
        shown: list[float] = []
        for extent in self.columns(now_s, count):
            if extent is not None:
                shown.append(extent.most)
            elif shown:
                shown.append(shown[-1])
        return shown

    def extent(self, now_s: float) -> Extent | None:
        """Return the smallest and largest numbers of the span; None: no number."""
        there = [one for one in self.columns(now_s, PARTS) if one is not None]
        return Extent(min(one.least for one in there), max(one.most for one in there)) if there else None
