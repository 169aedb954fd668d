"""Injects faults into a running mission, in one process at a time or two, and measures its recovery.

Each process of ``mission.xml`` gets SIGKILL, SIGTERM and SIGSTOP of 0.3, 1, 5 and 30 s, each in a mission
of its own. Printed for each, as one JSON line:

* ``noticed_s``: until a look at the mission shows the fault (health, the victim's process or restarts, absences).
* ``healthy_s``: until health is lastingly ``ok``, everything runs and pictures arrive; 0: this never ended.
* ``unsaid_s``: longest time in which the mission lacked something although its health was ``ok``.
* ``gap_s``: longest time without a picture; ``usual_gap_s``: the same before the fault, at a switch.
* ``violations`` of the trace of scheduling decisions, ``late_by_pause``: starts that were late because the RC manager
  itself was stopped, ``more``: processes in addition to those before the fault,
  ``left``: processes left after ``down``.

``--pairs``, ``--again``, ``--during`` and ``--soak`` inject other faults. ``--table`` also prints a table for people.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from measuring import report
from recovery_breaker import (
    DOWN_WITHIN_S,
    FAULTS,
    MENDED_WITHIN_S,
    ROWS,
    Breaker,
    breaker,
    breaking_calm,
    rounded,
)
from recovery_edges import DURING, try_edge
from recovery_mission import GONE_WITHIN_S, POLL_S, NotSeen
from recovery_soak import soak
from recovery_verdict import Fault


@dataclass(frozen=True, slots=True)
class Case:
    """The faults of one mission."""

    strikes: tuple[tuple[str, str], ...]

    def said(self) -> dict[str, str]:
        """Return the faults for a report."""
        return {
            "victim": " + ".join(victim for victim, _ in self.strikes),
            "fault": " + ".join(fault for _, fault in self.strikes),
        }


def try_case(case: Case, patience_s: float) -> dict[str, Any]:
    """Inject the faults into a mission of their own; return the effects."""
    with breaker(patience_s) as breaking:
        expected = breaking.calm()
        faults = [breaking.fault(victim, name) for victim, name in case.strikes]
        if any(fault.victim == "launcher" and fault.kills for fault in faults):
            return launcher_ended(breaking, faults)
        return {**breaking.see_through(expected, faults), **breaking.end()}


def launcher_ended(breaking: Breaker, faults: Sequence[Fault]) -> dict[str, Any]:
    """Return the time until nothing remains of a mission whose launcher is ended."""
    mission = breaking.mission
    breaking.strike(faults)
    mission.launcher.wait(DOWN_WITHIN_S)
    left = mission.left(GONE_WITHIN_S)
    while mission.directory.exists() and time.monotonic() < faults[0].at_s + 2 * GONE_WITHIN_S:
        time.sleep(POLL_S)
    return {"gone_s": rounded(time.monotonic() - faults[0].at_s) if not left else None, **breaking.aftermath()}


def again(victim: str, times: int, fault: str) -> None:
    """Inject the same fault into the same victim repeatedly, each time after the mission has recovered."""
    with breaking_calm() as (breaking, expected):
        for number in range(1, times + 1):
            found = breaking.see_through(expected, [breaking.fault(victim, fault)])
            report("recovery_again", victim=victim, fault=fault, number=number, **found)
            if found["healthy_s"] is None:
                break
        report("recovery_again", victim=victim, fault=fault, **breaking.end())


def pairs(number: int, seed: int, victims: Sequence[str]) -> list[Case]:
    """Return pairs of different random victims, each with a random fault."""
    rng = random.Random(seed)
    able = [victim for victim in victims if victim != "launcher"]
    return [Case(tuple((victim, rng.choice(FAULTS)) for victim in rng.sample(able, 2))) for _ in range(number)]


def table(results: Sequence[dict[str, Any]]) -> str:
    """Return a table for people: noticed, healthy, and the longest gap of pictures, seconds."""
    faults = list(dict.fromkeys(result["fault"] for result in results))
    lines = ["| victim | " + " | ".join(faults) + " |", "|---" * (len(faults) + 1) + "|"]
    for victim in dict.fromkeys(result["victim"] for result in results):
        by_fault = {result["fault"]: result for result in results if result["victim"] == victim}
        lines.append(f"| {victim} | " + " | ".join(cell(by_fault.get(fault)) for fault in faults) + " |")
    return "\n".join(lines)


def cell(result: dict[str, Any] | None) -> str:
    """Return one case as a cell: noticed / healthy / gap, or the duration of up or down; seconds."""
    if result is None:
        return ""
    if "gone_s" in result:
        return f"gone in {result['gone_s']}, exit {result['up_exit']}"
    if "failed" in result:
        return str(result["failed"])
    for took in ("up_in_s", "down_in_s"):
        if took in result:
            return f"{result[took]}, exit {result['up_exit']}, {result['left']} left"
    shown = ["–" if result[key] is None else f"{result[key]:.1f}" for key in ("noticed_s", "healthy_s", "gap_s")]
    return " / ".join(shown)


def main() -> None:
    """Inject the faults and print the effects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--victim", action="append", choices=list(ROWS), help="only these")
    parser.add_argument("--fault", action="append", choices=FAULTS, help="only these")
    parser.add_argument("--pairs", type=int, default=0, metavar="N", help="N pairs at once, from --seed")
    parser.add_argument("--again", nargs=2, metavar=("VICTIM", "N"), help="the same N times in a row")
    parser.add_argument("--during", choices=DURING, help="while the mission comes up, or goes down")
    parser.add_argument("--soak", type=float, default=0.0, metavar="MINUTES", help="random faults, from --seed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--patience", type=float, default=MENDED_WITHIN_S, metavar="S", help="what takes longer is not mended"
    )
    parser.add_argument("--table", action="store_true", help="print a table, too")
    given = parser.parse_args()
    victims, faults = given.victim or list(ROWS), given.fault or list(FAULTS)
    if given.again:
        again(given.again[0], int(given.again[1]), faults[0])
        return
    if given.soak:
        soak(given.soak, given.seed, victims)
        return
    if given.pairs:
        cases = pairs(given.pairs, given.seed, victims)
    else:
        cases = [Case(((victim, fault),)) for victim in victims for fault in faults]
    results = []
    during = {"during": given.during} if given.during else {}
    for case in cases:
        try:
            if given.during:
                found = try_edge(given.during, *case.strikes[0], given.patience)
            else:
                found = try_case(case, given.patience)
        except NotSeen as error:
            found = {"failed": str(error)}
        report("recovery", **case.said(), **during, **found)
        results.append({**case.said(), **found})
    if given.table:
        print(table(results))


if __name__ == "__main__":
    main()
