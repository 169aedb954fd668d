"""Start places of robots, in the notation of the mission file."""

from __future__ import annotations

import math

from resource_pool.dead_reckoning import FARTHEST_M, FloorPose


def read_begins(text: str) -> dict[str, FloorPose]:
    """Return name → place of a text like ``scout1:1,1,90 scout2:3,1``; headings are degrees, 0 if left out.

    Raises:
        ValueError: A part of the text is not a named place, or a name occurs twice.

    Example:
        >>> read_begins("scout1:1,2")
        {'scout1': FloorPose(x_m=1.0, y_m=2.0, heading_rad=0.0)}
    """
    begins: dict[str, FloorPose] = {}
    for part in text.split():
        name, _, place = part.partition(":")
        try:
            x_m, y_m, heading_deg = (*(float(number) for number in place.split(",")), 0.0)[:3]
        except ValueError:
            raise ValueError(f"{part!r} is no place: write name:x,y,heading in meters and degrees") from None
        if not name or place.count(",") not in (1, 2) or not all(abs(n) <= FARTHEST_M for n in (x_m, y_m, heading_deg)):
            raise ValueError(f"{part!r} is no place: write name:x,y,heading in meters and degrees")
        if name in begins:
            raise ValueError(f"{name} has two places")
        begins[name] = FloorPose(x_m, y_m, math.radians(heading_deg))
    return begins
