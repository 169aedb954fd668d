"""Places in a trace at which a planter puts its fault."""

from __future__ import annotations

from random import Random

from trace_checker.trace_format import Line


def place_of(lines: list[Line], rng: Random, *events: str) -> int | None:
    """Return where one of the lines with these events is."""
    places = [place for place, line in enumerate(lines) if line["ev"] in events]
    return rng.choice(places) if places else None


def next_of(lines: list[Line], after: int, arc: str, *events: str) -> int | None:
    for place in range(after + 1, len(lines)):
        if lines[place].get("arc") == arc and lines[place]["ev"] in events:
            return place
    return None


def move(lines: list[Line], place: int, time_s: float) -> None:
    """Put the line to another time, behind all lines of that time."""
    line = lines.pop(place)
    line["t"] = time_s
    behind = [at for at, other in enumerate(lines) if other["t"] <= time_s]
    lines.insert(behind[-1] + 1 if behind else 0, line)


def active(lines: list[Line], before: int) -> dict[str, str]:
    """Return the last step of each ARC that has asked and not left."""
    last: dict[str, str] = {}
    for line in lines[:before]:
        if line["ev"] in ("request", "connect", "grant", "revoke", "free", "idle", "depart"):
            last[line["arc"]] = line["ev"]
    return {arc: step for arc, step in last.items() if step != "depart"}


def somewhere(lines: list[Line], rng: Random, *steps: str) -> tuple[int, str] | None:
    """Return a place and an ARC whose last step before it was one of these."""
    for _ in range(20):
        place = rng.randrange(1, len(lines))
        found = [arc for arc, step in active(lines, place).items() if step in steps]
        if found:
            return place, rng.choice(found)
    return None


def rcs_of(lines: list[Line], arc: str) -> list[str]:
    return next((list(line["use"]) for line in lines if line["ev"] == "request" and line["arc"] == arc), [])
