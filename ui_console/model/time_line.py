"""Time line: the time of a recording in columns, with its markers, and steps in it. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from backbone.recording.markers import Marker, MarkerKind

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # chosen: SLOWEST to FASTEST, easily told apart
WEIGHTS = {MarkerKind.GRANT: 0, MarkerKind.REVOKED: 1, MarkerKind.OPERATOR: 2, MarkerKind.ALARM: 3}
"""If a column has several markers, the one with the largest weight is shown."""


@dataclass(frozen=True)
class TimeLine:
    """The time of a recording.

    Attributes:
        begin_s: Mission time of its first message.
        end_s: Mission time of its last message.
        markers: Markers in the order of time; none until they are read.
    """

    begin_s: float
    end_s: float
    markers: Sequence[Marker]

    def column(self, at_s: float, columns: int) -> int:
        """Return the column of a mission time; the end is in the last column."""
        share = (at_s - self.begin_s) / max(self.end_s - self.begin_s, 1e-9)
        return min(columns - 1, max(0, int(share * columns)))

    def time(self, column: int, columns: int) -> float:
        """Return the mission time at which a column begins; for the last column its end, to reach both ends."""
        if column >= columns - 1:
            return self.end_s
        return self.begin_s + max(0, column) * (self.end_s - self.begin_s) / columns

    def marks(self, columns: int) -> list[MarkerKind | None]:
        """Return the kind of marker that each column shows; None: no marker."""
        found: list[MarkerKind | None] = [None] * columns
        for marker in self.markers:
            column = self.column(marker.at_s, columns)
            there = found[column]
            if there is None or WEIGHTS[marker.kind] > WEIGHTS[there]:
                found[column] = marker.kind
        return found

    def before(self, at_s: float) -> Marker | None:
        """Return the last marker before a mission time; None: no marker."""
        return next((marker for marker in reversed(self.markers) if marker.at_s < at_s), None)

    def upto(self, at_s: float) -> Marker | None:
        """Return the last marker at a mission time or before it; None: there is none."""
        return next((marker for marker in reversed(self.markers) if marker.at_s <= at_s), None)

    def after(self, at_s: float) -> Marker | None:
        """Return the first marker after a mission time; None: there is none."""
        return next((marker for marker in self.markers if marker.at_s > at_s), None)


def next_speed(speed: float, steps: int) -> float:
    """Return the speed that is this many steps faster; negative: slower.

    Example:
        >>> next_speed(1.0, 1), next_speed(1.0, -1), next_speed(100.0, 1)
        (2.0, 0.5, 100.0)
    """
    at = min(range(len(SPEEDS)), key=lambda number: abs(SPEEDS[number] - speed))
    return SPEEDS[min(max(0, at + steps), len(SPEEDS) - 1)]
