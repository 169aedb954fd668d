"""Rates of execution units: the share of its rounds that a unit of 1 to 200 Hz gets while half the processors are busy.

``bench/unit_rates.py [--for S] [--idle] [--nice N]``. All units run at once for the whole time, in two processes: in
one in the event loop, in the other each in a thread of its own. Beside them other processes compute. So ten minutes of
all rates are ``--for 600``. Prints one JSON line for each unit; ``share`` is the number of rounds divided by the number
that the frequency demands. The last line names every unit that missed rounds: how many, and how late its latest was.

Exit code 1: a unit had less than 99 % of its rounds.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

import msgspec
import uvloop
from measuring import report

from backbone.bus.clock import MissionClock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from backbone.wire import Message
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder
from mission_control.modules.unit_component import UnitComponent

RATES_HZ = (1.0, 10.0, 20.0, 50.0, 100.0, 200.0)
LEAST_SHARE = 0.99
STEPS = 300  # chosen: a round of some 20 µs
COMPUTES = "while True: pass"
LONGEST_S = 86_400.0  # chosen: a day


class Total(Message, frozen=True):
    """A sum."""

    value: float


class Adding(Module):
    """Computes a little."""

    class Outputs(Module.Outputs):
        """The sum."""

        total: Total

    def update(self, inputs: Module.Inputs) -> Outputs:  # noqa: ARG002
        """Return a sum."""
        return self.Outputs(Total(float(sum(range(STEPS)))))


class FreeUnit(UnitComponent):
    """A unit without a nameserver."""

    registers = False


@contextmanager
def half_busy(processes: int) -> Iterator[None]:
    """Keep this number of processors busy."""
    busy = [subprocess.Popen([sys.executable, "-c", COMPUTES]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


async def rates(for_s: float, own_thread: bool, nice: int) -> dict[float, dict[str, float]]:
    """Return rate → statistics of the unit with this frequency."""
    clock, network = MissionClock.started_now(), LocalNetwork()
    units: dict[float, FreeUnit] = {}
    for rate_hz in RATES_HZ:
        name = f"unit{rate_hz:.0f}"
        module = ModuleOrder("adding", f"{__name__}:Adding", outputs={"total": f"total{rate_hz:.0f}"})
        order = UnitOrder(name=name, frequency_hz=rate_hz, own_thread=own_thread, nice=nice, modules=[module])
        given = msgspec.to_builtins(arranged([order], {})[name])
        launch = Launch("bench", Subsystem.MISSION_CONTROL, name, "unit", "", "here", "", 0.0, 1.0, given)
        units[rate_hz] = FreeUnit(launch, network.join(launch.address, clock), clock)
    lives = [asyncio.create_task(unit.run()) for unit in units.values()]
    await clock.sleep_s(for_s)
    told = {rate_hz: unit.statistics() for rate_hz, unit in units.items()}
    for unit in units.values():
        unit.end("measured")
    await asyncio.gather(*lives)
    return told


def rates_of(for_s: float, own_thread: bool, nice: int) -> dict[float, dict[str, float]]:
    """Return the same, in a process of its own."""
    return uvloop.run(rates(for_s, own_thread, nice))


def told(rate_hz: float, one: dict[str, float], for_s: float, **how: object) -> tuple[float, str]:
    """Print the line of a unit; return its share, and its missed rounds in words."""
    asked = int(for_s * rate_hz) or 1
    share = one["rounds"] / asked
    report(
        "unit_rates",
        frequency_hz=rate_hz,
        **how,
        share=round(min(1.0, share), 4),
        missed=one["missed"],
        mean_late_ms=round(one["mean_late_s"] * 1000, 3),
        most_late_ms=round(one["most_late_s"] * 1000, 3),
    )
    missed = f"{one['missed']:.0f} of {asked} rounds, the latest {one['most_late_s'] * 1000:.1f} ms late"
    return share, missed if one["missed"] else ""


def main() -> int:
    """Print one line for each unit, without and with a thread, and one about missed rounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--for", dest="for_s", type=float, default=20.0, help="seconds, of all units at once")
    parser.add_argument("--idle", action="store_true", help="leave the processors idle")
    parser.add_argument("--nice", type=int, default=0, help="added to the niceness of the threads")
    given = parser.parse_args()
    if not 1.0 <= given.for_s <= LONGEST_S:
        parser.error(f"--for takes 1 to {LONGEST_S:.0f} seconds")
    busy = 0 if given.idle else max(1, (os.cpu_count() or 1) // 2)
    shares, misses = list[float](), dict[str, str]()
    with half_busy(busy), ProcessPoolExecutor(2, get_context("spawn")) as pool:
        halves = {
            own_thread: pool.submit(rates_of, given.for_s, own_thread, given.nice if own_thread else 0)
            for own_thread in (False, True)
        }
        found = {own_thread: half.result() for own_thread, half in halves.items()}
    for own_thread, units in found.items():
        nice = given.nice if own_thread else 0
        for rate_hz, one in units.items():
            share, missed = told(rate_hz, one, given.for_s, own_thread=own_thread, nice=nice, busy_processes=busy)
            shares.append(share)
            if missed:
                misses[f"{rate_hz:g} Hz {'in a thread' if own_thread else 'in the event loop'}"] = missed
    report("unit_rates", for_s=given.for_s, least_share=round(min(1.0, *shares), 4), misses=misses)
    return 0 if min(shares) >= LEAST_SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
