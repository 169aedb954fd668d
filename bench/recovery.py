"""Injects faults into a running mission, in one process at a time, and measures its recovery.

Each process of ``mission.xml`` gets SIGKILL, SIGTERM and SIGSTOP of 0.3, 1, 5 and 30 s, each in a mission
of its own. Printed for each, as one JSON line:

* ``noticed_s``: until a look at the mission shows the fault (health, the victim's process or restarts, absences).
* ``healthy_s``: until health is lastingly ``ok``, everything runs and pictures arrive; 0: this never ended.
* ``unsaid_s``: longest time in which the mission lacked something although its health was ``ok``.
* ``gap_s``: longest time without a picture; ``usual_gap_s``: the same before the fault, at a switch.
* ``violations`` of the trace of scheduling decisions, ``late_by_pause``: starts that were late because the RC manager
  itself was stopped, ``more``: processes in addition to those before the fault,
  ``left``: processes left after ``down``.

``--table`` also prints a table for people.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from itertools import product
from typing import Any

from measuring import report
from recovery_breaker import DOWN_WITHIN_S, FAULTS, MENDED_WITHIN_S, ROWS, Breaker, breaker, rounded
from recovery_mission import GONE_WITHIN_S, POLL_S, NotSeen
from recovery_verdict import Fault


def try_fault(victim: str, name: str, patience_s: float) -> dict[str, Any]:
    """Inject the fault into a mission of its own; return the effects."""
    with breaker(patience_s) as breaking:
        expected = breaking.calm()
        fault = breaking.fault(victim, name)
        if victim == "launcher" and fault.kills:
            return launcher_ended(breaking, fault)
        return {**breaking.see_through(expected, fault), **breaking.end()}


def launcher_ended(breaking: Breaker, fault: Fault) -> dict[str, Any]:
    """Return the time until nothing remains of a mission whose launcher is ended."""
    mission = breaking.mission
    breaking.strike(fault)
    mission.running.launcher.wait(DOWN_WITHIN_S)
    left = mission.left()
    while mission.running.directory.exists() and time.monotonic() < fault.at_s + 2 * GONE_WITHIN_S:
        time.sleep(POLL_S)
    return {"gone_s": rounded(time.monotonic() - fault.at_s) if not left else None, **breaking.aftermath()}


def table(results: Sequence[dict[str, Any]]) -> str:
    """Return a table for people: noticed, healthy, and the longest gap of pictures, seconds."""
    faults = list(dict.fromkeys(result["fault"] for result in results))
    lines = ["| victim | " + " | ".join(faults) + " |", "|---" * (len(faults) + 1) + "|"]
    for victim in dict.fromkeys(result["victim"] for result in results):
        by_fault = {result["fault"]: result for result in results if result["victim"] == victim}
        lines.append(f"| {victim} | " + " | ".join(cell(by_fault.get(fault)) for fault in faults) + " |")
    return "\n".join(lines)


def cell(result: dict[str, Any] | None) -> str:
    """Return one fault as a cell: noticed / healthy / gap, seconds."""
    if result is None:
        return ""
    if "gone_s" in result:
        return f"gone in {result['gone_s']}, exit {result['up_exit']}"
    if "failed" in result:
        return str(result["failed"])
    shown = ["–" if result[key] is None else f"{result[key]:.1f}" for key in ("noticed_s", "healthy_s", "gap_s")]
    return " / ".join(shown)


def main() -> None:
    """Inject the faults and print the effects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--victim", action="append", choices=list(ROWS), help="only these")
    parser.add_argument("--fault", action="append", choices=FAULTS, help="only these")
    parser.add_argument(
        "--patience", type=float, default=MENDED_WITHIN_S, metavar="S", help="what takes longer is not mended"
    )
    parser.add_argument("--table", action="store_true", help="print a table, too")
    given = parser.parse_args()
    results = []
    for victim, fault in product(given.victim or ROWS, given.fault or FAULTS):
        try:
            found = try_fault(victim, fault, given.patience)
        except (NotSeen, AssertionError) as error:
            found = {"failed": str(error)}
        results.append({"victim": victim, "fault": fault, **found})
        report("recovery", **results[-1])
    if given.table:
        print(table(results))


if __name__ == "__main__":
    main()
