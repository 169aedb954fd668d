"""Ways to spoil the contents of a trace's lines, one fault each; see ``planted_faults``."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from trace_checker.places_in_traces import place_of
from trace_checker.trace_format import Line

Planter = Callable[[list[Line], Random], bool]

CONTENTS: dict[str, Planter] = {}


def _planter(function: Planter) -> Planter:
    CONTENTS[function.__name__] = function
    return function


def _changes(kind: str, event: str, change: Callable[[Line, Random], bool]) -> None:
    def alter(lines: list[Line], rng: Random) -> bool:
        place = place_of(lines, rng, event)
        return place is not None and change(lines[place], rng)

    CONTENTS[kind] = alter


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
    place = place_of(lines, rng, "grant")
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
    place = place_of(lines, rng, "request")
    if place is None:
        return False
    rcs = [line["id"] for line in lines if line["ev"] == "rc"]
    lines[place]["use"][rng.choice(rcs)] = "x"
    return True


def _streams(lines: list[Line]) -> list[Line]:
    requests = [line for line in lines if line["ev"] == "request"]
    return [stream for line in requests for use in line["use"].values() if isinstance(use, list) for stream in use]


@_planter
def streams_cost_more(lines: list[Line], rng: Random) -> bool:
    streams = _streams(lines)
    if not streams:
        return False
    rng.choice(streams)["cost"] *= rng.choice([1.5, 2.0])
    return True


@_planter
def streams_are_due_early(lines: list[Line], rng: Random) -> bool:
    streams = _streams(lines)
    if not streams:
        return False
    stream = rng.choice(streams)
    stream["deadline"] = round(stream["cost"] * rng.choice([0.9, 1.0, 1.5, 2.0]), 6)
    return True
