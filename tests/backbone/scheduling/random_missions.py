"""Missions of random shape: up to eight ARCs, six RCs, trees, radios, faults, idling, departures."""

from __future__ import annotations

from random import Random
from typing import Any

from simulated_switches import MISSION, TOLERANCE_S, Bench, ask, manager, sharable, unit

from backbone.scheduling.events import (
    CapacityChanged,
    Departed,
    Event,
    Extended,
    Idled,
    RcCameBack,
    RcKnown,
    RcWentDown,
    Requested,
    RuntimeChanged,
    Wanted,
)
from backbone.scheduling.requests import RcUse, SchedulingRefusal, Usage

END_S = 60.0
GRID_S = 0.25  # coarse: many things happen at the same instant


def random_mission(
    rng: Random, *, tolerance_s: float = TOLERANCE_S, faults: bool = True, **rules: Any
) -> tuple[Bench, list[tuple[float, Event]]]:
    """Return a bench with RCs, and what will happen on it."""
    rcs = [_rc(rng, number) for number in range(rng.randint(1, 6))]
    grace_s = rng.choice([0.0, 0.0, 0.2])
    bench = Bench(
        manager(grace_s=grace_s, tolerance_s=tolerance_s, **rules),
        *rcs,
        pause_s=lambda deadline_s: rng.choice([0.0, deadline_s / 2, deadline_s]),
        delay_s=(lambda: 0.0) if tolerance_s == TOLERANCE_S else (lambda: rng.uniform(0.0, tolerance_s / 5)),
    )
    level = rng.choice([1, 2, 3])
    tree = {f"p{number}": rng.randint(1, level) for number in range(rng.randint(1, 3))}
    asked = [_request(rng, number, rcs, tree, level) for number in range(rng.randint(2, 9))]
    requests = [request for request in asked if _can_ever_run(bench, request)][:8]
    if not requests:
        return bench, []
    happens = _happens(rng, requests, [0, 0, 2, 6])
    if faults:
        for _ in range(rng.choice([0, 0, 0, 1, 2])):
            happens += _fault(rng, rng.choice(rcs))
        for request in requests:
            if rng.random() < 0.05:
                bench.fails[request.request.arc] = rng.choice(["", *request.rcs])
    return bench, sorted(happens, key=lambda item: item[0])


def crowded_mission(rng: Random, **rules: Any) -> tuple[Bench, list[tuple[float, Event]]]:
    """Return a bench as ``random_mission``, with 8 to 24 ARCs and up to 14 RCs."""
    return _crowd(rng, rcs=(3, 14), arcs=(8, 24), whims=[0, 2, 6, 12], rules=rules)


def fleet_mission(rng: Random, **rules: Any) -> tuple[Bench, list[tuple[float, Event]]]:
    """Return a bench as ``random_mission``, with 100 to 250 ARCs and up to 80 RCs."""
    return _crowd(rng, rcs=(30, 80), arcs=(100, 250), whims=[0, 20], rules=rules)


def _crowd(
    rng: Random, *, rcs: tuple[int, int], arcs: tuple[int, int], whims: list[int], rules: dict[str, Any]
) -> tuple[Bench, list[tuple[float, Event]]]:
    """Return a bench with some number of RCs, and what that number of ARCs does on it."""
    present = [_rc(rng, number) for number in range(rng.randint(*rcs))]
    grace_s = rng.choice([0.0, 0.0, 0.2])
    bench = Bench(
        manager(grace_s=grace_s, **rules),
        *present,
        pause_s=lambda deadline_s: rng.choice([0.0, deadline_s / 2, deadline_s]),
    )
    level = rng.choice([1, 2, 3])
    tree = {f"p{number}": rng.randint(1, level) for number in range(rng.randint(1, 5))}
    asked = [_request(rng, number, present, tree, level) for number in range(rng.randint(*arcs))]
    requests = [request for request in asked if _can_ever_run(bench, request)]
    if not requests:
        return bench, []
    happens = _happens(rng, requests, whims)
    for _ in range(rng.choice([0, 0, 1, 2])):
        happens += _fault(rng, rng.choice(present))
    return bench, sorted(happens, key=lambda item: item[0])


def play(bench: Bench, happens: list[tuple[float, Event]], until_s: float = END_S) -> Bench:
    for time_s, event in happens:
        bench.at(time_s, event)
    return bench.run(until_s)


def _happens(rng: Random, requests: list[Requested], whims: list[int]) -> list[tuple[float, Event]]:
    """Return the requests, and as many whims of theirs as one of these numbers."""
    happens: list[tuple[float, Event]] = [(_time(rng, 8.0) if rng.random() < 0.5 else 0.0, r) for r in requests]
    changes = [(_time(rng), _whim(rng, rng.choice(requests))) for _ in range(rng.choice(whims))]
    # A repeated request would make shorter again what was made longer; the checker knows only the last length.
    changing = {whim.arc for _, whim in changes if isinstance(whim, RuntimeChanged)}
    return happens + [
        (time_s, whim) for time_s, whim in changes if not (isinstance(whim, Requested) and whim.request.arc in changing)
    ]


def _can_ever_run(bench: Bench, request: Requested) -> bool:
    try:
        return bool(bench.manager.choose(request.request))
    except SchedulingRefusal:
        return False


def _time(rng: Random, most_s: float = END_S) -> float:
    return rng.randint(0, int(most_s / GRID_S)) * GRID_S


def _rc(rng: Random, number: int) -> RcKnown:
    connect_s, disconnect_s = rng.choice([0.0, 0.0, 0.3, 0.5]), rng.choice([0.0, 0.0, 0.05, 0.25])
    if rng.random() < 0.35:
        return sharable(f"r{number}", rng.choice([1.0, 1.0, 0.8, 0.5]), connect_s, disconnect_s)
    return unit(f"u{number}", connect_s, disconnect_s)


def _request(rng: Random, number: int, rcs: list[RcKnown], tree: dict[str, int], level: int) -> Requested:
    chosen = rng.sample(rcs, rng.randint(1, min(3, len(rcs))))
    run_s = rng.choice([1.0, 2.0, 2.5, 5.0, 5.0, 8.0])
    console = rng.random() < 0.2
    parent = rng.choice([*tree])
    own = (f"n{number}", rng.randint(1, level))
    way = [(MISSION, 0), (parent, tree[parent]), own]
    if rng.random() < 0.3:
        way = [(MISSION, 0), own]
    if rng.random() < 0.1:
        way = [(MISSION, 0), (parent, tree[parent])]
    if console:
        way = [(f"n{number}", rng.choice([-1, 0, 0, 1]))]
    return ask(
        f"a{number}",
        {rc.rc: _streams(rng) if rc.sharable and rng.random() < 0.85 else RcUse() for rc in chosen},
        path=way,
        console=console,
        run_s=run_s,
        most_s=rng.choice([0.0, run_s, run_s + 2.5]),
        idle=rng.random() < 0.15,
    )


def _streams(rng: Random) -> RcUse:
    return RcUse([_stream(rng) for _ in range(rng.choice([1, 1, 2]))])


def _stream(rng: Random) -> Usage:
    period_s = rng.choice([0.01, 0.02, 0.05, 0.1])
    packet_s = round(period_s * rng.choice([0.05, 0.1, 0.2, 0.3, 0.4, 0.5]), 6)
    deadline_s = rng.choice([0.0, 0.0, round(period_s * 0.7, 6)])
    return Usage(period_s, packet_s, deadline_s, rng.choice([0.0, 0.0, 0.002]))


def _whim(rng: Random, of: Requested) -> Event:
    arc = of.request.arc
    # Only longer ones: the checker measures all waits by the last maximum run time it heard of.
    run_s = of.request.maximum_runtime_s + 8.0
    whims: list[Event] = [
        Idled(arc),
        Idled(arc),
        Wanted(arc),
        Wanted(arc),
        Departed(arc),
        of,
        RuntimeChanged(arc, run_s, run_s),
        Extended(arc, _time(rng)),
    ]
    return rng.choice(whims)


def _fault(rng: Random, rc: RcKnown) -> list[tuple[float, Event]]:
    begin_s = _time(rng)
    if rc.sharable and rng.random() < 0.5:
        return [(begin_s, CapacityChanged(rc.rc, rng.choice([0.2, 0.4, 0.9])))]
    return [(begin_s, RcWentDown(rc.rc)), (begin_s + _time(rng, 10.0), RcCameBack(rc.rc, 0))]
