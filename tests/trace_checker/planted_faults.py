"""Ways to spoil a sound trace, one fault each: what a checker must not overlook.

A planter gets the lines of a trace and a generator of random numbers; it changes the lines in place and
returns whether it found a place for its fault. Whether the rules forbid what comes out is for a checker
to say: a late grant within the tolerance is none, and the end of a slice may be right where it is put.
"""

from __future__ import annotations

import copy
from random import Random

from trace_checker.contents_of_lines import CONTENTS, Planter
from trace_checker.places_in_traces import move, next_of, place_of, rcs_of, somewhere
from trace_checker.trace_format import Line

PLANTERS: dict[str, Planter] = {}


def planted(kind: str, lines: list[Line], rng: Random) -> list[Line] | None:
    """Return a copy of the trace with a fault of this kind, or nothing where the trace has no place for it."""
    spoiled = copy.deepcopy(lines)
    return spoiled if PLANTERS[kind](spoiled, rng) else None


def _planter(function: Planter) -> Planter:
    PLANTERS[function.__name__] = function
    return function


def _drops(event: str) -> None:
    def drop(lines: list[Line], rng: Random) -> bool:
        place = place_of(lines, rng, event)
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
    place = place_of(lines, rng, "revoke")
    if place is None:
        return False
    free = next_of(lines, place, lines[place]["arc"], "free")
    for one in (free, place):
        if one is not None:
            del lines[one]
    return True


@_planter
def start_is_missing(lines: list[Line], rng: Random) -> bool:
    """An ARC's connect and grant, with all that follows of that run."""
    place = place_of(lines, rng, "connect")
    if place is None:
        return False
    arc = lines[place]["arc"]
    until = next_of(lines, place, arc, "connect") or len(lines)
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
        place = place_of(lines, rng, event)
        if place is None:
            return False
        time_s = round(lines[place]["t"] + rng.uniform(least_s, most_s), 3)
        move(lines, place, min(max(time_s, 0.0), lines[-1]["t"]))
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
    place = place_of(lines, rng, "connect")
    grant = None if place is None else next_of(lines, place, lines[place]["arc"], "grant")
    if place is None or grant is None:
        return False
    by_s = rng.uniform(0.05, 3.0)
    for one in (grant, place):
        move(lines, one, round(max(0.0, lines[one]["t"] - by_s), 3))
    return True


@_planter
def run_begins_late(lines: list[Line], rng: Random) -> bool:
    place = place_of(lines, rng, "connect")
    grant = None if place is None else next_of(lines, place, lines[place]["arc"], "grant")
    if place is None or grant is None:
        return False
    by_s = rng.uniform(0.05, 3.0)
    end_s = lines[-1]["t"]
    for one in (grant, place):
        move(lines, one, round(min(end_s, lines[one]["t"] + by_s), 3))
    lines.sort(key=lambda line: line["ev"] == "end")
    return True


@_planter
def line_stands_twice(lines: list[Line], rng: Random) -> bool:
    place = rng.randrange(len(lines))
    lines.insert(place, copy.deepcopy(lines[place]))
    return True


def _adds(kind: str, steps: tuple[str, ...], *added: Line) -> None:
    def add(lines: list[Line], rng: Random) -> bool:
        found = somewhere(lines, rng, *steps)
        if found is None:
            return False
        place, arc = found
        time_s = lines[place]["t"]
        epochs = dict.fromkeys(rcs_of(lines, arc), 1000)
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
        held = place_of(lines, rng, "grant", "connect")
        if held is None:
            return False
        rcs = rcs_of(lines, lines[held]["arc"])
        place = held + rng.choice([0, 0, 1])
        lines.insert(place, {"t": lines[held]["t"], "id": rng.choice(rcs or ["nothing"]), **line})
        return True

    PLANTERS[kind] = add


_adds_for_rc("rc_goes_down", {"ev": "rc_state", "state": "down"})
_adds_for_rc("rc_has_no_capacity_left", {"ev": "rc_cap", "cap": 0.05})
_adds_for_rc("rc_has_half_its_capacity", {"ev": "rc_cap", "cap": 0.5})


PLANTERS.update(CONTENTS)
