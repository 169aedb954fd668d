"""Cost of an idle mission: wake-ups and processor time, process by process, while no client asks anything.

Prints one JSON line. A wake-up is a context switch of a thread that had waited (voluntary, from ``/proc``).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import psutil
from measuring import MISSION_XML, busy_s, report
from missions import mission_up, own_processes

SETTLE_S = 5.0  # chosen: the behaviors have their ARCs, and the first slices have begun


def wake_ups(pid: int) -> int:
    """Return how often the threads of a process have waited since their start."""
    found = 0
    for status in Path(f"/proc/{pid}/task").glob("*/status"):
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        found += int(lines["voluntary_ctxt_switches"])
    return found


def name_of(process: psutil.Process) -> str:
    """Return the name of a process; the zygote names each process for its component."""
    return Path(f"/proc/{process.pid}/comm").read_text().strip()


def measured(processes: Sequence[psutil.Process], seconds: float) -> dict[int, tuple[float, float]]:
    """Return wake-ups a second and share of a core of each process over so many seconds."""
    before = {one: (wake_ups(one.pid), busy_s([one])) for one in processes}
    began_s = time.monotonic()
    time.sleep(seconds)
    span_s = time.monotonic() - began_s
    return {
        one.pid: ((wake_ups(one.pid) - waited) / span_s, (busy_s([one]) - then_s) / span_s)
        for one, (waited, then_s) in before.items()
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mission", nargs="?", type=Path, default=MISSION_XML)
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    with mission_up(given.mission) as running:
        time.sleep(SETTLE_S)
        names = {one.pid: name_of(one) for one in own_processes(running)}
        found = measured([*map(psutil.Process, names)], given.seconds)
    rows = sorted(((names[pid], *figures) for pid, figures in found.items()), key=lambda row: -row[1])
    report(
        "idle",
        mission=given.mission.name,
        processes=len(found),
        wake_ups_per_s=round(sum(wakes for _, wakes, _ in rows)),
        core_percent=round(100 * sum(share for _, _, share in rows), 1),
        by_process=[[name, round(wakes), round(100 * share, 2)] for name, wakes, share in rows],
    )


if __name__ == "__main__":
    main()
