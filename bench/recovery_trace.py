"""The trace of scheduling decisions under faults: broken rules, and starts that were late because of a fault itself.

Rules of this file: no processes, no bus. Times are the mission's clock.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from trace_checker import check
from trace_checker.violation import Violation

LATE = frozenset({"RR", "WC", "PRIO"})  # a missing start; all other violations are wrong actions, not late ones
SINCE = re.compile(r"waits since (?P<since_s>[0-9.]+)")
WAKES_WITHIN_S = 0.1  # chosen: a process that continues makes its first decision within a few ms


def violations(trace: Path, pauses: Sequence[tuple[float, float]]) -> tuple[list[Violation], list[Violation]]:
    """Return the rules that the trace breaks, and separately the starts that were late because of a pause.

    Each life of the RC manager is judged by itself; it begins with a ``meta`` line and its adoptions.

    Args:
        pauses: Times at which the RC manager's process was stopped and continued.
    """
    lives: list[list[dict[str, Any]]] = []
    for line in trace.read_text().splitlines():
        if line.endswith("}"):  # a killed process may not have finished its last line
            event = json.loads(line)
            if event["ev"] == "meta":
                lives.append([])
            lives[-1].append(event)
    broken, late = list[Violation](), list[Violation]()
    for life in lives:
        for found in check(life):
            (late if is_late_by_a_pause(found, life, pauses) else broken).append(found)
    return broken, late


def is_late_by_a_pause(found: Violation, life: list[dict[str, Any]], pauses: Sequence[tuple[float, float]]) -> bool:
    """Return whether a due start fell into a pause, and the RC manager decided as soon as it continued."""
    since = SINCE.match(found.msg)
    if found.code not in LATE or since is None:
        return False
    due_s = float(since["since_s"])
    decided_s = min((event["t"] for event in life if event["t"] > due_s), default=due_s)
    return any(at_s - WAKES_WITHIN_S <= due_s <= decided_s <= on_s + WAKES_WITHIN_S for at_s, on_s in pauses)
