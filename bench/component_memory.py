"""Memory of an idle component, beside a bare interpreter and a fresh one with the same imports.

Prints one JSON line. ``own`` is the memory that would be freed if the process ended (unique set size). ``share`` also
counts its part of the shared memory (proportional set size). Both are in MB of 10^6 bytes.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from statistics import median

import psutil
import uvloop
from component_start import creator_up, end_light, start_light
from measuring import report

COMPONENTS = 20
IMPORTS = "import backbone.component.process"


def memory(pid: int) -> tuple[float, float]:
    """Return own and proportional memory of a process in MB."""
    found = psutil.Process(pid).memory_full_info()
    return found.uss / 1e6, found.pss / 1e6


def interpreter_memory(program: str) -> tuple[float, float]:
    """Return the memory of an interpreter that ran this program and waits."""
    command = [sys.executable, "-c", f"{program}; print(flush=True); input()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        found = memory(process.pid)
        process.kill()
    return found


async def component_memories(count: int) -> list[tuple[float, float]]:
    """Return the memory of each of so many components, all ready and idle at once."""
    with tempfile.TemporaryDirectory() as folder:
        async with creator_up(folder) as bus:
            started = await start_light(bus, count)
            found = [memory(each.pid) for each in started]
            await end_light(bus, count)
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--components", type=int, default=COMPONENTS)
    count = parser.parse_args().components
    bare, fresh = interpreter_memory("pass"), interpreter_memory(IMPORTS)
    found = uvloop.run(component_memories(count))
    own, share = [one[0] for one in found], [one[1] for one in found]
    report(
        "component_memory",
        components=count,
        own_mb=round(median(own), 2),
        own_most_mb=round(max(own), 2),
        share_mb=round(median(share), 2),
        floor="a bare interpreter / a fresh one with the same imports",
        floor_own_mb=round(bare[0], 2),
        floor_share_mb=round(bare[1], 2),
        fresh_own_mb=round(fresh[0], 2),
        ratio=round(median(own) / bare[0], 2),
    )


if __name__ == "__main__":
    main()
