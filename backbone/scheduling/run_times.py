"""Run times: the shortest and longest slices that can be planned. Pure."""

from __future__ import annotations

from backbone.ranges import A_DAY_S
from backbone.scheduling.requests import MissingRuntime

SHORTEST_RUNTIME_S = 0.001  # chosen: less than any context switch takes; shorter slices only waste the RCs' time


def can_be_planned(least_s: float, most_s: float) -> bool:
    """Return whether slices of these times can be planned."""
    return SHORTEST_RUNTIME_S <= least_s <= most_s <= A_DAY_S


def require_runtime(arc: str, least_s: float, most_s: float) -> None:
    """Return if slices of these times can be planned, else raise; a longest time of 0 is the shortest time.

    Raises:
        MissingRuntime: No slice can have these run times.
    """
    if not can_be_planned(least_s, most_s or least_s):
        raise MissingRuntime(f"{arc} asks for at least {least_s:g} s and at most {most_s:g} s", arc=arc)
