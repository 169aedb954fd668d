"""The geometry of all surveillance experiments: places of Scouts, passages of targets, and times in view.

Pure. The room is that of the shipped ``mission.xml``; no number here differs between conditions. The papers
do not give camera poses; these fit all their rates (SCHEDULING.md, section 6).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]
Interval = tuple[float, float]

ROOM_M = (9.0, 6.0)
PATH: tuple[Point, Point] = ((0.0, 3.0), (9.0, 3.0))
WATCHERS: tuple[Point, ...] = ((0.72, 1.764), (7.20, 0.527), (3.40, 2.050), (5.60, 2.050), (1.90, 2.050))
"""Places of watching Scouts, which all look along +y; the first two are the papers'."""
EXTRAS: tuple[Point, ...] = tuple((4.5 + 0.75 * column, row) for row in (1.2, 1.9) for column in (0, 1, -1, -2, -3))
"""Places of driven Scouts: outside all views, and not on the target's path."""
VIEW_RAD = math.radians(40.0)
"""Horizontal angle of view of a Scout's camera (``scout_model.dimensions``)."""
FRAME_RATE_HZ = 15.0
FRAMES_PER_S = 30
SETTLING_S = 0.3
SLICE_S = 5.0


@dataclass(frozen=True, slots=True)
class Passage:
    """The passage of a target.

    Attributes:
        shape: ``pioneer`` or ``person``.
        speed_m_s: Speed along the path.
        there_and_back: True: it turns at the path's end and returns.
        radius_m: Half of its visible width.
    """

    shape: str
    speed_m_s: float
    there_and_back: bool
    radius_m: float

    @property
    def lasts_s(self) -> float:
        """Time from the path's beginning to the end of the passage."""
        legs = 2 if self.there_and_back else 1
        return legs * math.dist(*PATH) / self.speed_m_s


PIONEER = Passage("pioneer", 0.5, False, 0.2)
"""IROS 2001: chosen there for its repeatable speed; one pass."""
PERSON = Passage("person", 1.2, True, 0.2)
"""RAM 2002: 7 to 8 s across, and 7 to 8 s back."""
PASSAGES = {passage.shape: passage for passage in (PIONEER, PERSON)}


def seen_along(watcher: Point, radius_m: float) -> Interval:
    """Return the part of the path on which a target of this radius is at least partly in the watcher's view.

    Args:
        watcher: Place of the watcher, which looks along +y.
        radius_m: Radius of a disc around the target's place.

    Returns:
        First and last distance from the path's beginning, metres, within the path.

    Example:
        >>> first_m, last_m = seen_along((7.20, 0.527), 0.2)
        >>> round(first_m, 2), round(last_m, 2)
        (6.09, 8.31)
    """
    ahead_m = PATH[0][1] - watcher[1]
    reach_m = ahead_m * math.tan(VIEW_RAD / 2) + radius_m / math.cos(VIEW_RAD / 2)
    length_m = math.dist(*PATH)
    middle_m = watcher[0] - PATH[0][0]
    return max(0.0, middle_m - reach_m), min(length_m, middle_m + reach_m)


def in_view(passage: Passage, watcher: Point, *, least_m: float = 0.0) -> list[Interval]:
    """Return when the passing target is in the watcher's view, seconds from its departure, in order.

    Args:
        least_m: Width of the target that must be in view.
    """
    first_m, last_m = seen_along(watcher, passage.radius_m)
    edge_m = least_m / math.cos(VIEW_RAD / 2)
    first_m, last_m = first_m + edge_m, last_m - edge_m
    if first_m >= last_m:
        return []
    there = [(first_m / passage.speed_m_s, last_m / passage.speed_m_s)]
    if not passage.there_and_back:
        return there
    whole_m = 2 * math.dist(*PATH)
    return [*there, ((whole_m - last_m) / passage.speed_m_s, (whole_m - first_m) / passage.speed_m_s)]


def shortest_view_s(passage: Passage, watcher: Point) -> float:
    """Return the shortest time for which the passing target is in the watcher's view, seconds."""
    return min(end_s - begin_s for begin_s, end_s in in_view(passage, watcher))


def is_in_view(passage: Passage, watcher: Point, since_departure_s: float) -> bool:
    """Return whether the target is at least partly in the watcher's view at this time."""
    return any(begin_s <= since_departure_s <= end_s for begin_s, end_s in in_view(passage, watcher))
