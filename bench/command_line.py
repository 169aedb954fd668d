"""Waiting times of the command line: help, version, completion, status, beside a bare interpreter.

Prints one JSON line for each command: its median time from the start of the process to its end, and as floor the time
of ``python -c pass``, both measured in turns. Completion and status run without a mission and beside the smallest one.
``--aim`` ends with 1 if a median is above its aim.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from measuring import BIN, report
from missions import mission_up

from mission_control.laboratory.module_kit.real_mission import runtime_directory

MISSION = Path(__file__).parents[1] / "docs" / "examples" / "smallest.xml"
FLOOR = (sys.executable, "-c", "pass")
HELP_S = COMPLETION_S = 0.12  # chosen: a person perceives a tenth of a second as immediate
STATUS_S = 0.3  # chosen: includes the mission's time to answer
NOTHING: Mapping[str, str] = {}


def completion(*typed: str) -> dict[str, str]:
    """Return the environment that bash sets to ask for completions of the last word."""
    name = f"_{typed[0].replace('-', '_').upper()}_COMPLETE"
    return {name: "complete_bash", "COMP_WORDS": " ".join(typed), "COMP_CWORD": str(len(typed) - 1)}


def seconds(command: Sequence[str], environment: Mapping[str, str]) -> float:
    """Run the command once, and return its duration."""
    began_s = time.perf_counter()
    subprocess.run(command, env=environment, check=False, capture_output=True)
    return time.perf_counter() - began_s


def measure(name: str, command: Sequence[str], aim_s: float, rounds: int, typed: Mapping[str, str] = NOTHING) -> bool:
    """Print one JSON line about the command, and return whether it is within its aim.

    Args:
        typed: Environment of a completion.
    """
    environment = {**os.environ, **typed}
    took, floors = [], []
    for _ in range(rounds):
        floors.append(seconds(FLOOR, environment))
        took.append(seconds(command, environment))
    took_s, floor_s = median(took), median(floors)
    report(
        "command_line",
        command=name,
        rounds=rounds,
        ms=round(took_s * 1e3, 1),
        best_ms=round(min(took) * 1e3, 1),
        aim_ms=round(aim_s * 1e3),
        floor="python -c pass",
        floor_ms=round(floor_s * 1e3, 1),
        ratio=round(took_s / floor_s, 1),
    )
    return took_s <= aim_s


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--aim", action="store_true")
    given = parser.parse_args()
    backbone, console = str(BIN / "scout-backbone"), str(BIN / "scout-console")
    rounds, names = given.rounds, completion("scout-backbone", "why", "")
    with tempfile.TemporaryDirectory() as folder, runtime_directory(folder):
        within = [
            measure("scout-backbone --help", (backbone, "--help"), HELP_S, rounds),
            measure("scout-console --help", (console, "--help"), HELP_S, rounds),
            measure("scout-backbone --version", (backbone, "--version"), HELP_S, rounds),
            measure("scout-backbone st<Tab>", (backbone,), COMPLETION_S, rounds, completion("scout-backbone", "st")),
            measure("scout-backbone why <Tab>, no mission", (backbone,), COMPLETION_S, rounds, names),
        ]
    robots = completion("scout-console", "attach", "")
    with mission_up(MISSION):
        within += [
            measure("scout-backbone why <Tab>, mission up", (backbone,), COMPLETION_S, rounds, names),
            measure("scout-console attach <Tab>, mission up", (console,), COMPLETION_S, rounds, robots),
            measure("scout-backbone status, mission up", (backbone, "status"), STATUS_S, rounds),
        ]
    if given.aim and not all(within):
        sys.exit(1)


if __name__ == "__main__":
    main()
