"""Time that the schedule manager takes to decide, from ten ARCs to ten thousand.

A seeded fleet runs on virtual time: all ARCs send requests within one slice, then slices end, new ARCs come and old
ones leave. Only ``ScheduleManager.handle`` is measured, by kind of event: a request, the release by an ARC that runs,
the end of a slice, and the two outcomes of a context switch (freed, opened).

Beside it, for fleets that a constraint solver can handle in seconds: how many ARCs run at once and how many slices are
served, compared with a solver bound by the same rules and one free of them (``scheduler_solver.py``; needs the extra
``bench``).

Prints one JSON line for the headline sizes. ``--table`` prints how the time grows. ``--arcs N --rcs M --shape S``
measure one size. ``--no-solver`` and ``--only-solver`` skip one half.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from time import perf_counter
from typing import Any

from measuring import percentile, report
from scheduler_instances import KINDS, MISSION, SHAPES, Fleet, Stopwatch, TooSlow, fleet

try:
    import scheduler_solver
except ModuleNotFoundError as missing:
    if missing.name != "ortools":
        raise
    scheduler_solver = None

from backbone.scheduling.events import Departed
from backbone.scheduling.rehearsal import Rehearsal, Timetable
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager

SIZES = ((10, 20), (30, 20), (100, 50), (1000, 200), (10_000, 1000))
HEADLINE = ((30, 20), (10_000, 1000))
SOLVED_SIZES = ((30, 20), (100, 50), (400, 100))
SOLVED_SLOTS = 24  # chosen: two minutes of the papers' slices
AIMS_MS = {30: {"p50": 0.5}, 10_000: {"p50": 5.0, "p99": 20.0}}
ARRIVALS_S = 5.0  # chosen: one slice, so that slice ends are spread over time
CHANGES_S = 15.0  # chosen: mission time between two changes times RCs; about as many changes as slice ends


@dataclass
class Measured:
    """The measurements of one size.

    Attributes:
        arcs: ARCs in the complete fleet.
        asked: ARCs that sent a request before the time was over.
        whole: True if the fleet was complete and had run for a while when its decisions were measured.
        build_s: Seconds of deciding until all had sent requests and run for a while.
        times_s: Kind of event → seconds, in the running fleet; in the growing one if it did not become complete.
        parallel: ARCs that ran at once, on average over the measured mission time.
    """

    shape: str
    arcs: int
    rcs: int
    asked: int
    whole: bool
    build_s: float
    times_s: dict[str, list[float]]
    parallel: float

    def ms(self, kind: str, share: float) -> float | None:
        """Return a percentile in milliseconds; None: no such event occurred."""
        times_s = self.times_s.get(kind)
        return round(percentile(times_s, share) * 1000, 3) if times_s else None

    def slowest_ms(self, share: float) -> float | None:
        """Return the percentile of the slowest kind of event."""
        return max((ms for kind in self.times_s if (ms := self.ms(kind, share)) is not None), default=None)

    def meets_aims(self) -> bool | None:
        """Return whether every kind of event meets the aims for this size; None: the size has no aims."""
        aims = AIMS_MS.get(self.arcs)
        if aims is None:
            return None
        shares = {"p50": 0.5, "p99": 0.99}
        reached = {name: self.slowest_ms(shares[name]) for name in aims}
        return self.whole and all(ms is not None and ms < aims[name] for name, ms in reached.items())

    def as_json(self) -> dict[str, object]:
        """Return the measurements for the JSON line."""
        return {
            "shape": self.shape,
            "arcs": self.arcs,
            "rcs": self.rcs,
            **({} if self.whole else {"gave_up_at_arcs": self.asked}),
            "build_s": round(self.build_s, 2),
            "slowest_kind": {"p50_ms": self.slowest_ms(0.5), "p99_ms": self.slowest_ms(0.99)},
            **{kind: {"p50_ms": self.ms(kind, 0.5), "p99_ms": self.ms(kind, 0.99)} for kind in self.times_s},
            "meets_aims": self.meets_aims(),
        }


def measure(of: Fleet, arcs: int, *, events: int, within_s: float, seed: int) -> Measured:
    """Return the durations of decisions in a fleet of this size.

    Args:
        of: RCs and a source of requests.
        events: Requests and releases to measure, each; slice ends happen meanwhile.
        within_s: Seconds of wall time before giving up; half of it for building the fleet.
        seed: Seed of arrivals and departures.
    """
    rng = Random(seed)
    manager = ScheduleManager(SchedulingRules(grace_s=0.2), tolerance_s=0.05, mission=MISSION, mission_priority=0)
    building = Stopwatch(manager, perf_counter() + within_s)
    rehearsal = Rehearsal(building)
    for rc in of.rcs:
        rehearsal.tell(rc)
    arrivals = sorted(rng.uniform(0.0, ARRIVALS_S) for _ in range(arcs))
    present = [f"arc{number}" for number in range(arcs)]
    for name, at_s in zip(present, arrivals, strict=True):
        rehearsal.at(at_s, of.request(name))
    try:
        rehearsal.run(2 * ARRIVALS_S)
    except TooSlow:
        return _result(of, arcs, building, building, 0.0, whole=False)
    gc.collect()  # else one of the measured decisions waits for the collector of what the building left
    running = Stopwatch(manager, perf_counter() + within_s)
    began_s, step_s = rehearsal.now_s, CHANGES_S / len(of.rcs)
    rehearsal.manager = running
    try:
        for number in range(events):
            present.append(f"late{number}")
            rehearsal.tell(of.request(present[-1]))
            rehearsal.run(rehearsal.now_s + step_s)
            leaver = rng.choice([*rehearsal.connected] or present)
            present.remove(leaver)
            rehearsal.tell(Departed(leaver))
            rehearsal.run(rehearsal.now_s + step_s)
    except TooSlow:
        pass
    parallel = Timetable(rehearsal.trace, rehearsal.now_s).mean_parallel(began_s)
    return _result(of, arcs, building, running, parallel, whole=True)


def _result(of: Fleet, arcs: int, building: Stopwatch, running: Stopwatch, parallel: float, *, whole: bool) -> Measured:
    asked = len(building.times_s["request"])
    build_s = sum(map(sum, building.times_s.values()))
    times_s = {kind: times for kind, times in running.times_s.items() if kind != "other" and times}
    return Measured(of.shape, arcs, len(of.rcs), asked, whole, build_s, times_s, parallel)


def table(measured: Sequence[Measured]) -> str:
    """Return a table for people: one line a size."""
    kinds = list(KINDS.values())
    lines = [
        f"{'shape':8s} {'ARCs':>6s} {'RCs':>5s} {'build s':>8s} {'at once':>8s} "
        + " ".join(f"{kind + ' ms':>19s}" for kind in kinds)
        + "   (median / 99th percentile)"
    ]
    for one in measured:
        cells = [f"{_number(one.ms(kind, 0.5))} / {_number(one.ms(kind, 0.99))}" for kind in kinds]
        note = "" if one.whole else f"   gave up when {one.asked} had asked"
        lines.append(
            f"{one.shape:8s} {one.arcs:6d} {one.rcs:5d} {one.build_s:8.2f} {one.parallel:8.1f} "
            + " ".join(f"{cell:>19s}" for cell in cells)
            + note
        )
    return "\n".join(lines)


def _number(ms: float | None) -> str:
    return "-" if ms is None else f"{ms:.3f}"


def solve(
    shapes: Sequence[str], sizes: Sequence[tuple[int, int]], solve_s: float, within_s: float, seed: int
) -> list[Any]:
    """Return the comparisons with the solver; none if it is not installed."""
    if scheduler_solver is None:
        print("no solver: pip install 'scout-backbone[bench]'", file=sys.stderr)
        return []
    return [
        scheduler_solver.compare(
            fleet(shape, rcs, seed, connect_s=0.0, disconnect_s=0.0),
            arcs,
            slots=SOLVED_SLOTS,
            solve_s=solve_s,
            within_s=within_s,
        )
        for shape in shapes
        for arcs, rcs in sizes
    ]


def solver_table(compared: Sequence[Any]) -> str:
    """Return a table for people: one line a fleet."""
    ways = ("ours", "staggered", "bound", "free")
    lines = [
        f"{'shape':8s} {'ARCs':>5s} {'RCs':>4s} "
        + " ".join(f"{way + ': at once':>18s} {'load':>5s} {'slices/h':>8s}" for way in ways)
        + "  never (free)  price of fairness"
    ]
    for one in compared:
        cells = []
        for way in ways:
            outcome = getattr(one, way)
            if outcome is None:
                cells.append(f"{'too slow':>18s} {'':5s} {'':8s}")
                continue
            most = "" if outcome.proven else f" (≤ {outcome.at_most:.1f})"
            cells.append(f"{f'{outcome.at_once:.1f}{most}':>18s} {outcome.load:5.0%} {outcome.slices_per_h:8.0f}")
        lines.append(
            f"{one.shape:8s} {one.arcs:5d} {one.rcs:4d} {' '.join(cells)}"
            f"  {one.free.never:12d}  {one.price_of_fairness:17.0%}"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arcs", type=int, help="one size only")
    parser.add_argument("--rcs", type=int, help="with --arcs; default: a tenth, at least 20")
    parser.add_argument(
        "--shape", choices=SHAPES, action="append", help="repeatable; default: uniform, with --table all"
    )
    parser.add_argument("--events", type=int, default=200, help="requests and releases measured, each")
    parser.add_argument("--within", type=float, default=30.0, help="seconds for building and for measuring one size")
    parser.add_argument("--solve-within", type=float, default=1.0, help="seconds for one choice of the solver")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="all sizes and shapes, for people")
    half = parser.add_mutually_exclusive_group()
    half.add_argument("--no-solver", action="store_true", help="only the time of decisions")
    half.add_argument("--only-solver", action="store_true", help="only the comparison with the solver")
    chosen = parser.parse_args()
    sizes = SIZES if chosen.table else HEADLINE
    solved_sizes = SOLVED_SIZES
    if chosen.arcs is not None:
        sizes = solved_sizes = ((chosen.arcs, chosen.rcs or max(20, chosen.arcs // 10)),)
    shapes = chosen.shape or (SHAPES if chosen.table else SHAPES[:1])
    measured = [
        measure(fleet(shape, rcs, chosen.seed), arcs, events=chosen.events, within_s=chosen.within, seed=chosen.seed)
        for shape in shapes
        for arcs, rcs in ([] if chosen.only_solver else sizes)
    ]
    # A single size is passed to the solver only with --only-solver, because its time grows without limit.
    with_solver = chosen.only_solver or (chosen.arcs is None and not chosen.no_solver)
    compared = solve(shapes, solved_sizes, chosen.solve_within, chosen.within, chosen.seed) if with_solver else []
    if chosen.table:
        print("\n\n".join(filter(None, [measured and table(measured), compared and solver_table(compared)])))
    else:
        report(
            "scheduler",
            aims_ms={str(arcs): aims for arcs, aims in AIMS_MS.items()},
            sizes=[one.as_json() for one in measured],
            price_of_fairness=[one.as_json() for one in compared],
        )


if __name__ == "__main__":
    main()
