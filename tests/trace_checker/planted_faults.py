"""Ways to spoil a sound trace, one fault each: what a checker must not overlook.

A planter gets the lines of a trace and a generator of random numbers; it changes the lines in place and
returns whether it found a place for its fault. Whether the rules forbid what comes out is for a checker
to say: a late grant within the tolerance is none, and the end of a slice may be right where it is put.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from random import Random
from typing import Any

Line = dict[str, Any]
Planter = Callable[[list[Line], Random], bool]

PLANTERS: dict[str, Planter] = {}


def planted(kind: str, lines: list[Line], rng: Random) -> list[Line] | None:
    """Return a copy of the trace with a fault of this kind, or nothing where the trace has no place for it."""
    spoiled = copy.deepcopy(lines)
    return spoiled if PLANTERS[kind](spoiled, rng) else None


def _planter(function: Planter) -> Planter:
    PLANTERS[function.__name__] = function
    return function


def _place(lines: list[Line], rng: Random, *events: str) -> int | None:
    """Return where one of the lines with these events is."""
    places = [place for place, line in enumerate(lines) if line["ev"] in events]
    return rng.choice(places) if places else None


def _next(lines: list[Line], after: int, arc: str, *events: str) -> int | None:
    for place in range(after + 1, len(lines)):
        if lines[place].get("arc") == arc and lines[place]["ev"] in events:
            return place
    return None


def _move(lines: list[Line], place: int, time_s: float) -> None:
    """Put the line to another time, behind all lines of that time."""
    line = lines.pop(place)
    line["t"] = time_s
    behind = [at for at, other in enumerate(lines) if other["t"] <= time_s]
    lines.insert(behind[-1] + 1 if behind else 0, line)


# ---------------------------------------------------------------------- lines that are missing
def _drops(event: str) -> None:
    def drop(lines: list[Line], rng: Random) -> bool:
        place = _place(lines, rng, event)
        if place is not None:
            del lines[place]
        return place is not None

    PLANTERS[f"{event}_is_missing"] = drop


for _event in [
    "meta",
    "rc",
    "rc_state",
    "rc_cap",
    "node",
    "request",
    "want",
    "idle",
    "depart",
    "min_run",
    "extend",
    "connect",
    "grant",
    "revoke",
    "free",
    "end",
]:
    _drops(_event)


@_planter
def switch_is_missing(lines: list[Line], rng: Random) -> bool:
    """An ARC's revocation, and that it is free."""
    place = _place(lines, rng, "revoke")
    if place is None:
        return False
    free = _next(lines, place, lines[place]["arc"], "free")
    for one in (free, place):
        if one is not None:
            del lines[one]
    return True


@_planter
def start_is_missing(lines: list[Line], rng: Random) -> bool:
    """An ARC's connect and grant, with all that follows of that run."""
    place = _place(lines, rng, "connect")
    if place is None:
        return False
    arc = lines[place]["arc"]
    until = _next(lines, place, arc, "connect") or len(lines)
    gone = {"connect", "grant", "revoke", "free", "slice", "extend"}
    lines[place:until] = [line for line in lines[place:until] if line.get("arc") != arc or line["ev"] not in gone]
    return True


@_planter
def end_of_the_trace_comes_early(lines: list[Line], rng: Random) -> bool:
    end = lines[-1]
    place = rng.randrange(len(lines) // 2, len(lines))
    lines[place:] = [{**end, "t": lines[place]["t"]}]
    return True


@_planter
def nothing_happens_from_now_on(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(len(lines) // 2, len(lines))
    lines[place:-1] = []
    return True


# ---------------------------------------------------------------------- lines that stand elsewhere
@_planter
def neighbors_change_places(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(1, len(lines) - 1)
    lines[place - 1], lines[place] = lines[place], lines[place - 1]
    return True


@_planter
def neighbors_of_one_instant_change_places(lines: list[Line], rng: Random) -> bool:
    places = [place for place in range(1, len(lines)) if lines[place]["t"] == lines[place - 1]["t"]]
    if not places:
        return False
    place = rng.choice(places)
    lines[place - 1], lines[place] = lines[place], lines[place - 1]
    return True


@_planter
def time_runs_backwards(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(1, len(lines))
    lines[place]["t"] = round(lines[place]["t"] - rng.choice([0.001, 0.5, 3.0]), 6)
    return True


def _shifts(kind: str, event: str, least_s: float, most_s: float) -> None:
    def shift(lines: list[Line], rng: Random) -> bool:
        place = _place(lines, rng, event)
        if place is None:
            return False
        time_s = round(lines[place]["t"] + rng.uniform(least_s, most_s), 3)
        _move(lines, place, min(max(time_s, 0.0), lines[-1]["t"]))
        lines.sort(key=lambda line: line["ev"] == "end")
        return True

    PLANTERS[kind] = shift


_shifts("grant_comes_early", "grant", -0.3, -0.01)
_shifts("grant_comes_late", "grant", 0.01, 1.0)
_shifts("grant_comes_a_little_late", "grant", 0.0, 0.08)
_shifts("connect_comes_early", "connect", -2.0, -0.01)
_shifts("connect_comes_late", "connect", 0.01, 2.0)
_shifts("revoke_comes_early", "revoke", -3.0, -0.01)
_shifts("revoke_comes_late", "revoke", 0.01, 3.0)
_shifts("free_comes_early", "free", -0.3, -0.01)
_shifts("free_comes_late", "free", 0.01, 1.0)
_shifts("request_came_early", "request", -4.0, -0.01)
_shifts("request_comes_late", "request", 0.01, 4.0)
_shifts("want_came_early", "want", -4.0, -0.01)


@_planter
def everything_after_some_time_is_later(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(1, len(lines))
    by_s = rng.choice([0.02, 0.5, 2.0])
    for line in lines[place:]:
        line["t"] = round(line["t"] + by_s, 6)
    return True


@_planter
def run_begins_early(lines: list[Line], rng: Random) -> bool:
    """The connect and the grant of one run, both by the same time."""
    place = _place(lines, rng, "connect")
    grant = None if place is None else _next(lines, place, lines[place]["arc"], "grant")
    if place is None or grant is None:
        return False
    by_s = rng.uniform(0.05, 3.0)
    for one in (grant, place):
        _move(lines, one, round(max(0.0, lines[one]["t"] - by_s), 3))
    return True


@_planter
def run_begins_late(lines: list[Line], rng: Random) -> bool:
    place = _place(lines, rng, "connect")
    grant = None if place is None else _next(lines, place, lines[place]["arc"], "grant")
    if place is None or grant is None:
        return False
    by_s = rng.uniform(0.05, 3.0)
    end_s = lines[-1]["t"]
    for one in (grant, place):
        _move(lines, one, round(min(end_s, lines[one]["t"] + by_s), 3))
    lines.sort(key=lambda line: line["ev"] == "end")
    return True


# ---------------------------------------------------------------------- lines too many
@_planter
def line_stands_twice(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(len(lines))
    lines.insert(place, copy.deepcopy(lines[place]))
    return True


def _active(lines: list[Line], before: int) -> dict[str, str]:
    """Return the last step of each ARC that has asked and not left."""
    last: dict[str, str] = {}
    for line in lines[:before]:
        if line["ev"] in ("request", "connect", "grant", "revoke", "free", "idle", "depart"):
            last[line["arc"]] = line["ev"]
    return {arc: step for arc, step in last.items() if step != "depart"}


def _somewhere(lines: list[Line], rng: Random, *steps: str) -> tuple[int, str] | None:
    """Return a place and an ARC whose last step before it was one of these."""
    for _ in range(20):
        place = rng.randrange(1, len(lines))
        found = [arc for arc, step in _active(lines, place).items() if step in steps]
        if found:
            return place, rng.choice(found)
    return None


def _rcs_of(lines: list[Line], arc: str) -> list[str]:
    return next((list(line["use"]) for line in lines if line["ev"] == "request" and line["arc"] == arc), [])


def _adds(kind: str, steps: tuple[str, ...], *added: Line) -> None:
    def add(lines: list[Line], rng: Random) -> bool:
        found = _somewhere(lines, rng, *steps)
        if found is None:
            return False
        place, arc = found
        time_s = lines[place]["t"]
        epochs = dict.fromkeys(_rcs_of(lines, arc), 1000)
        lines[place:place] = [
            {"t": time_s, "arc": arc, **line, **({"epoch": epochs} if line["ev"] == "grant" else {})} for line in added
        ]
        return True

    PLANTERS[kind] = add


_adds("second_holder_connects", ("request", "free"), {"ev": "connect"})
_adds("second_holder_is_granted", ("request", "free"), {"ev": "connect"}, {"ev": "grant"})
_adds("grant_without_connect", ("request", "free"), {"ev": "grant"})
_adds("idle_arc_connects", ("idle",), {"ev": "connect"})
_adds("revoked_for_its_slice", ("grant",), {"ev": "revoke", "why": "slice"}, {"ev": "free"})
_adds("revoked_for_a_higher_one", ("grant",), {"ev": "revoke", "why": "higher"}, {"ev": "free"})
_adds("revoked_for_an_rc", ("grant",), {"ev": "revoke", "why": "rc"}, {"ev": "free"})
_adds("revoked_while_connecting", ("connect",), {"ev": "revoke", "why": "slice"}, {"ev": "free"})
_adds("revoked_while_waiting", ("request", "free"), {"ev": "revoke", "why": "slice"})
_adds("free_without_revoke", ("grant", "connect"), {"ev": "free"})
_adds("slice_of_a_runner", ("grant",), {"ev": "slice"})
_adds("slice_of_a_waiting_arc", ("request", "free"), {"ev": "slice"})
_adds("departs_while_it_runs", ("grant",), {"ev": "depart"})
_adds("idle_while_it_runs", ("grant",), {"ev": "idle"})
_adds("departs_while_it_waits", ("request", "free"), {"ev": "depart"})
_adds("extended_without_end", ("grant",), {"ev": "extend", "until": 1e6})
_adds("extended_while_it_waits", ("request", "free"), {"ev": "extend", "until": 100.0})
_adds("wants_while_it_waits", ("request", "free"), {"ev": "want"})
_adds("longer_than_asked_for", ("grant",), {"ev": "min_run", "min_run": 30.0, "max_run": 30.0})
_adds("line_of_unknown_kind", ("request", "free", "grant"), {"ev": "jump"})


def _adds_for_rc(kind: str, line: Line) -> None:
    def add(lines: list[Line], rng: Random) -> bool:
        held = _place(lines, rng, "grant", "connect")
        if held is None:
            return False
        rcs = _rcs_of(lines, lines[held]["arc"])
        place = held + rng.choice([0, 0, 1])
        lines.insert(place, {"t": lines[held]["t"], "id": rng.choice(rcs or ["nothing"]), **line})
        return True

    PLANTERS[kind] = add


_adds_for_rc("rc_goes_down", {"ev": "rc_state", "state": "down"})
_adds_for_rc("rc_has_no_capacity_left", {"ev": "rc_cap", "cap": 0.05})
_adds_for_rc("rc_has_half_its_capacity", {"ev": "rc_cap", "cap": 0.5})


# ---------------------------------------------------------------------- other contents
def _changes(kind: str, event: str, change: Callable[[Line, Random], bool]) -> None:
    def alter(lines: list[Line], rng: Random) -> bool:
        place = _place(lines, rng, event)
        return place is not None and change(lines[place], rng)

    PLANTERS[kind] = alter


def _sets(kind: str, event: str, /, **fields: Any) -> None:
    def put(line: Line, _: Random) -> bool:
        line.update(fields)
        return True

    _changes(kind, event, put)


_sets("another_mode", "meta", mode="strict")
_sets("another_discipline", "meta", discipline="time")
_sets("no_grace", "meta", grace=0.0)
_sets("long_grace", "meta", grace=2.0)
_sets("wide_tolerance", "meta", tol=0.3)
_sets("relaxed_work", "meta", wc="relaxed")
_sets("slow_to_connect", "rc", connect=0.7)
_sets("slow_to_disconnect", "rc", disconnect=0.4)
_sets("quick_to_connect", "rc", connect=0.0)
_sets("small_capacity", "rc", cap=0.3)
_sets("unit_instead_of_sharable", "rc", kind="unit")
_sets("unknown_arc", "grant", arc="nobody")
_sets("unknown_rc", "rc_state", id="nothing")
_sets("short_min_run", "request", min_run=0.5)
_sets("long_min_run", "request", min_run=9.0, max_run=9.0)
_sets("unknown_owner", "request", owner="m/nobody")
_sets("console_above_all", "request", owner={"ui": 9, "id": "planted"})
_sets("console_below_all", "request", owner={"ui": -9, "id": "planted"})
_sets("node_above_its_siblings", "node", prio=9)
_sets("revoked_for_another_reason", "revoke", why="higher")
_sets("revoked_for_no_reason", "revoke", why="slice")
_sets("no_epoch_at_all", "grant", epoch={})


@_planter
def epoch_of_an_earlier_grant(lines: list[Line], rng: Random) -> bool:
    place = _place(lines, rng, "grant")
    if place is None or not lines[place].get("epoch"):
        return False
    rc = rng.choice(sorted(lines[place]["epoch"]))
    lines[place]["epoch"][rc] -= rng.choice([1, 1, 2])
    return True


@_planter
def field_is_missing(lines: list[Line], rng: Random) -> bool:
    line = rng.choice(lines)
    fields = sorted(set(line) - {"by", "idle", "epoch"})
    del line[rng.choice(fields)]
    return True


@_planter
def two_arcs_change_names(lines: list[Line], rng: Random) -> bool:
    """From some time on."""
    arcs = sorted({line["arc"] for line in lines if "arc" in line})
    if len(arcs) < 2:
        return False
    one, other = rng.sample(arcs, 2)
    names = {one: other, other: one}
    for line in lines[rng.randrange(len(lines)) :]:
        if line.get("arc") in names:
            line["arc"] = names[line["arc"]]
    return True


@_planter
def uses_another_rc(lines: list[Line], rng: Random) -> bool:
    place = _place(lines, rng, "request")
    if place is None:
        return False
    rcs = [line["id"] for line in lines if line["ev"] == "rc"]
    lines[place]["use"][rng.choice(rcs)] = "x"
    return True


@_planter
def streams_cost_more(lines: list[Line], rng: Random) -> bool:
    streams = [
        stream
        for line in lines
        if line["ev"] == "request"
        for use in line["use"].values()
        if isinstance(use, list)
        for stream in use
    ]
    if not streams:
        return False
    rng.choice(streams)["cost"] *= rng.choice([1.5, 2.0])
    return True


@_planter
def streams_are_due_early(lines: list[Line], rng: Random) -> bool:
    streams = [
        stream
        for line in lines
        if line["ev"] == "request"
        for use in line["use"].values()
        if isinstance(use, list)
        for stream in use
    ]
    if not streams:
        return False
    stream = rng.choice(streams)
    stream["deadline"] = round(stream["cost"] * rng.choice([0.9, 1.0, 1.5, 2.0]), 6)
    return True
