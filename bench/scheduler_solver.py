"""The price of fairness: how many ARCs a constraint solver runs at once, bound by the rules or free of them.

All ARCs always want their RCs, all slices are equally long and switches take no time. So a schedule is a row of slots,
and each slot is a choice of ARCs that fit together. Three ways to choose:

* ``ours``: the schedule manager, on virtual time.
* ``bound``: in each slot the largest choice that the rules allow. An ARC is left out only because of an ARC that is
  higher, or equal and not served later. Only the order among those last served in the same slot is free, as in the
  rules. With a tree it is a little freer than the rules. It considers one slot at a time: the largest choice now may
  leave a worse one for later, so ``ours`` can be better, and is better with radios.
* ``free``: the largest choice of all, the same in every slot, so that the other ARCs never run.

A radio counts by the sum of its streams, so the solver is never more restricted there than the schedule manager.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import msgspec
from ortools.sat.python import cp_model
from scheduler_instances import MISSION, Fleet, Stopwatch, TooSlow

from backbone.scheduling.events import Requested
from backbone.scheduling.priority import Path, higher
from backbone.scheduling.rehearsal import Rehearsal, Timetable
from backbone.scheduling.requests import RcUse
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager

SLICE_S = 5.0  # RAM 2002: the papers' slice
PARTS = 1_000_000  # the solver uses whole numbers: a radio's capacity in millionths


@dataclass(frozen=True)
class Wish:
    """The demand of one ARC, the same in every slot.

    Attributes:
        uses: RC → share of its time, 0 to 1; an exclusive use is 1.
        path: Its owner's place in the tree.
    """

    uses: Mapping[str, float]
    path: Path


@dataclass(frozen=True)
class Rules:
    """The order that the rules allow in one slot.

    Attributes:
        turns: For each ARC a number; smaller ones may come before larger ones, equal ones in any order.
        above: For each ARC the ARCs that are higher.
    """

    turns: Sequence[int]
    above: Sequence[frozenset[int]]


@dataclass(frozen=True)
class Choice:
    """The ARCs of one slot.

    Attributes:
        arcs: Their numbers.
        at_most: Upper bound of the number of ARCs in any choice.
    """

    arcs: frozenset[int]
    at_most: int


@dataclass(frozen=True)
class Outcome:
    """The use of the RCs under one way to choose.

    Attributes:
        at_once: ARCs that run at once, on average.
        load: Used share of the RCs' time, 0 to 1.
        slices_per_h: Whole slices served in an hour.
        never: Number of ARCs that did not run in the examined time.
        proven: False: the solver ran out of time, so ``at_once`` may be less than the best.
        seconds: Wall time.
        at_most: Upper bound of ``at_once``; equal to it if proven.
    """

    at_once: float
    load: float
    slices_per_h: float
    never: int
    proven: bool
    seconds: float
    at_most: float

    def as_json(self) -> dict[str, object]:
        """Return the outcome for the JSON line."""
        return {
            "at_once": round(self.at_once, 2),
            "load": round(self.load, 3),
            "slices_per_h": round(self.slices_per_h),
            "never": self.never,
            "seconds": round(self.seconds, 2),
            **({} if self.proven else {"proven_at_most": round(self.at_most, 2)}),
        }


@dataclass(frozen=True)
class Comparison:
    """The three ways on one fleet, and the schedule manager when slice ends do not coincide.

    Attributes:
        ours: Outcome of the schedule manager; None: it took too long.
        staggered: As ``ours``, but the ARCs send their requests at random times of the first slice.
    """

    shape: str
    arcs: int
    rcs: int
    ours: Outcome | None
    staggered: Outcome | None
    bound: Outcome
    free: Outcome

    @property
    def price_of_fairness(self) -> float:
        """Share of the ARCs at once, 0 to 1, that the rules cost, by the better of the two ways that obey them."""
        fair = max(self.bound.at_once, 0.0 if self.ours is None else self.ours.at_once)
        return 1 - fair / self.free.at_once

    def as_json(self) -> dict[str, object]:
        """Return the comparison for the JSON line."""
        ours = {"ours": self.ours, "staggered": self.staggered, "bound": self.bound, "free": self.free}
        return {
            "shape": self.shape,
            "arcs": self.arcs,
            "rcs": self.rcs,
            **{name: None if outcome is None else outcome.as_json() for name, outcome in ours.items()},
            "of_bound": None if self.ours is None else round(self.ours.at_once / self.bound.at_once, 3),
            "price_of_fairness": round(self.price_of_fairness, 3),
        }


def compare(of: Fleet, arcs: int, *, slots: int, solve_s: float, within_s: float) -> Comparison:
    """Return the outcomes of the three ways on one fleet.

    Args:
        of: RCs that connect and disconnect at once, and a source of requests.
        arcs: ARCs that always want their RCs.
        slots: Number of slices to examine.
        solve_s: Seconds that the solver has for one choice; thirty times as long for the free one.
        within_s: Seconds that the schedule manager has.
    """
    requests = [_with_one_slice(of.request(f"arc{number}")) for number in range(arcs)]
    wishes = [_wish(request) for request in requests]
    arrivals_s = [0.0] * arcs
    staggered_s = sorted(of.rng.uniform(0.0, SLICE_S) for _ in range(arcs))
    return Comparison(
        of.shape,
        arcs,
        len(of.rcs),
        _ours(of, requests, arrivals_s, slots, within_s),
        _ours(of, requests, staggered_s, slots, within_s),
        bound_by_rules(of, wishes, slots=slots, solve_s=solve_s),
        free_of_rules(of, wishes, solve_s=30 * solve_s),
    )


def bound_by_rules(of: Fleet, wishes: Sequence[Wish], *, slots: int, solve_s: float) -> Outcome:
    """Return the outcome if the largest choice that the rules allow is made in each slot."""
    began = perf_counter()
    served_last = [-1] * len(wishes)
    above = [frozenset(i for i, other in enumerate(wishes) if higher(other.path, wish.path)) for wish in wishes]
    chosen: list[Choice] = []
    for slot in range(slots):
        rules = Rules(_turns(above, served_last), above)
        chosen.append(largest_choice(of, wishes, solve_s=solve_s, rules=rules))
        for number in chosen[-1].arcs:
            served_last[number] = slot
    return _outcome(of, wishes, chosen, perf_counter() - began)


def free_of_rules(of: Fleet, wishes: Sequence[Wish], *, solve_s: float) -> Outcome:
    """Return the outcome if the largest choice of all is made in each slot."""
    began = perf_counter()
    chosen = [largest_choice(of, wishes, solve_s=solve_s)]
    return _outcome(of, wishes, chosen, perf_counter() - began)


def largest_choice(of: Fleet, wishes: Sequence[Wish], *, solve_s: float, rules: Rules | None = None) -> Choice:
    """Return a largest choice of ARCs that fit together.

    Args:
        of: The RCs.
        wishes: Demands of all ARCs.
        solve_s: Seconds that the solver has.
        rules: Rules by which an ARC may be left out only with an excuse; None: no rules.

    Raises:
        TooSlow: The solver found no choice.
    """
    model = cp_model.CpModel()
    runs = [model.new_bool_var(f"runs {number}") for number in range(len(wishes))]
    users = {rc.rc: [number for number, wish in enumerate(wishes) if rc.rc in wish.uses] for rc in of.rcs}
    capacity = {rc.rc: int(rc.capacity * PARTS) for rc in of.rcs if rc.sharable}
    for rc, numbers in users.items():
        if rc in capacity:
            model.add(sum(_parts(wishes[number], rc) * runs[number] for number in numbers) <= capacity[rc])
        else:
            model.add_at_most_one(runs[number] for number in numbers)
    if rules is not None:
        for number in range(len(wishes)):
            model.add_bool_or(_excuses(model, number, wishes, runs, users, capacity, rules))
    model.maximize(sum(runs))
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = solve_s
    solver.parameters.num_workers = 1
    status = solver.solve(model)
    if status not in {cp_model.OPTIMAL, cp_model.FEASIBLE}:
        raise TooSlow
    arcs = frozenset(number for number, variable in enumerate(runs) if solver.value(variable))
    return Choice(arcs, int(solver.best_objective_bound + 1e-6))


def _turns(above: Sequence[frozenset[int]], served_last: Sequence[int]) -> list[int]:
    """Return the order of the turns, smaller is earlier: no ARC comes before a higher one."""
    turns = list(served_last)
    for number in sorted(range(len(turns)), key=lambda number: len(above[number])):
        turns[number] = max([turns[number], *(turns[one] for one in above[number])])
    return turns


def _excuses(
    model: cp_model.CpModel,
    number: int,
    wishes: Sequence[Wish],
    runs: Sequence[cp_model.IntVar],
    users: Mapping[str, Sequence[int]],
    capacity: Mapping[str, int],
    rules: Rules,
) -> list[cp_model.IntVar]:
    """Return conditions of which one must be true: the ARC runs, or an ARC that may precede it blocks it."""
    excuses = [runs[number]]
    for rc in wishes[number].uses:
        before = [
            other
            for other in users[rc]
            if other != number and rules.turns[other] <= rules.turns[number] and number not in rules.above[other]
        ]
        if rc not in capacity:
            excuses += [runs[other] for other in before]
            continue
        full = model.new_bool_var(f"{rc} is full for {number}")
        taken = sum(_parts(wishes[other], rc) * runs[other] for other in before)
        model.add(taken >= capacity[rc] - _parts(wishes[number], rc) + 1).only_enforce_if(full)
        excuses.append(full)
    return excuses


def _parts(wish: Wish, rc: str) -> int:
    return round(wish.uses[rc] * PARTS)


def _outcome(of: Fleet, wishes: Sequence[Wish], chosen: Sequence[Choice], seconds: float) -> Outcome:
    at_once = sum(len(choice.arcs) for choice in chosen) / len(chosen)
    used = sum(sum(wishes[number].uses.values()) for choice in chosen for number in choice.arcs)
    served = frozenset().union(*(choice.arcs for choice in chosen))
    return Outcome(
        at_once=at_once,
        load=used / len(chosen) / len(of.rcs),
        slices_per_h=at_once * 3600 / SLICE_S,
        never=len(wishes) - len(served),
        proven=all(len(choice.arcs) == choice.at_most for choice in chosen),
        seconds=seconds,
        at_most=sum(choice.at_most for choice in chosen) / len(chosen),
    )


def _ours(
    of: Fleet, requests: Sequence[Requested], arrivals_s: Sequence[float], slots: int, within_s: float
) -> Outcome | None:
    began = perf_counter()
    manager = ScheduleManager(SchedulingRules(grace_s=0.0), tolerance_s=1e-6, mission=MISSION, mission_priority=0)
    rehearsal = Rehearsal(Stopwatch(manager, began + within_s))
    try:
        for rc in of.rcs:
            rehearsal.tell(rc)
        for request, at_s in zip(requests, arrivals_s, strict=True):
            rehearsal.at(at_s, request)
        rehearsal.run(slots * SLICE_S)
    except TooSlow:
        return None
    seen = Timetable(rehearsal.trace, rehearsal.now_s)
    load = seen.utilization()
    at_once = seen.mean_parallel(since_s=arrivals_s[-1])
    return Outcome(
        at_once=at_once,
        load=sum(load.values()) / len(load),
        slices_per_h=sum(int(run.granted_s / SLICE_S + 1e-6) for run in seen.runs) * 3600 / seen.end_s,
        never=len(requests) - len({run.arc for run in seen.runs}),
        proven=True,
        seconds=perf_counter() - began,
        at_most=at_once,
    )


def _with_one_slice(request: Requested) -> Requested:
    return Requested(msgspec.structs.replace(request.request, minimum_runtime_s=SLICE_S), request.rcs)


def _wish(request: Requested) -> Wish:
    (uses,) = request.request.alternatives
    path = tuple((node.name, node.priority) for node in request.request.path)
    return Wish({rc: _share(use) for rc, use in uses.items()}, path)


def _share(use: RcUse) -> float:
    return sum(stream.packet_time_s / stream.period_s for stream in use.streams) if use.streams else 1.0
