"""From the command to all ready: the whole mission of IROS 2001, figure 2, beside bare process starts.

Prints one JSON line: the seconds that the launcher took, by its own clock and by the shell's; and, as floor, the
seconds that the machine needs to start as many bare interpreters, two at a time.
"""

from __future__ import annotations

import argparse
import re
import time
from statistics import median

from measuring import END_WITHIN_S, MISSION_XML, bare_interpreters_s, report
from missions import mission_up

PROCESSES = 20  # components of that mission, core services included


def mission_start() -> tuple[float, float]:
    """Bring the mission up and down once; return seconds by the launcher's clock and by the shell's."""
    began_s = time.monotonic()
    with mission_up(MISSION_XML) as running:
        ready_s = time.monotonic() - began_s
    assert running.launcher.returncode == 0, running.story()
    found = re.search(r"was ready after ([\d.]+) s", running.wait_for_line("was ready after", END_WITHIN_S))
    assert found is not None
    return float(found.group(1)), ready_s


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    starts, floors = [], []
    for _ in range(rounds):
        floors.append(bare_interpreters_s(PROCESSES))
        starts.append(mission_start())
    ready_s, floor_s = median(shell for _, shell in starts), median(floors)
    report(
        "mission_start",
        rounds=rounds,
        ready_s=round(ready_s, 3),
        ready_by_launcher_s=round(median(own for own, _ in starts), 3),
        slowest_s=round(max(shell for _, shell in starts), 3),
        floor=f"{PROCESSES} bare interpreters, two at a time",
        floor_s=round(floor_s, 3),
        ratio=round(ready_s / floor_s, 2),
    )


if __name__ == "__main__":
    main()
