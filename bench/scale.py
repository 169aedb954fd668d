"""Missions that grow: 3, 10, 30, 60 and 100 Scouts, a watcher for each; a radio, a frequency and a grabber for five.

Prints one JSON line for each size:

* how long it took until all was ready, how long ``status`` then takes at once, and when and how fast it lists every
  component: behaviors start theirs after all is ready, so the first list names some as being started;
* processor time by kind of process, memory as far as it is a process's own or its part of what several share (PSS),
  threads;
* context switches by the RC manager's trace, from revocation to grant, settling not counted: those while nobody starts;
* take-overs by an operator, from asking to the first command that the robot's RC applied;
* pictures a second of each grabber, and how many it allows at the end: where the processors are full, they fall first.

The floor is one question to the RC manager through the same hub, asked meanwhile. If the machine has other work, use
only counts and processor time. A size is skipped if it needs more memory than the machine has free.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import re
import subprocess
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import psutil
from idle import name_of
from measuring import BIN, busy_s, percentile, report
from missions import RealMission, mission_up, own_processes
from scale_mission import NAME, SETTLE_S, SHARING, components, mission_file
from switch_time import switches_s

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus
from backbone.command_line.where import Where
from backbone.component.messages import AskState, AskStatistics, ComponentState, Statistics
from backbone.errors import BackboneError
from backbone.launcher.mission_connection import connected
from ui_console.model.driving import DriveWish
from ui_console.model.events import Asked, CommandApplied, ConsoleEvent
from ui_console.session.joining import join
from ui_console.session.teleoperation import Teleoperation

SIZES = [3, 10, 30, 60, 100]
MOST_MB_A_SCOUT = 60.0  # measured: 56 before any optimization
WHOLE_WITHIN_S = 20.0  # chosen: allows for other work on the machine; behaviors get their ARCs after all is ready
STATUS_WITHIN_S = 60.0
ASK_EVERY_S = 0.05
TAKE_OVER_WITHIN_S = 20.0


class Took(NamedTuple):
    """Duration of a command, and its processor time."""

    wall_s: float
    processor_s: float


def status() -> tuple[Took, dict[str, Any]]:
    """Run ``status``; return its duration and its output."""
    began_s, before = time.monotonic(), os.times()
    command = [str(BIN / "scout-backbone"), "status", "--json", "--mission", NAME]
    done = subprocess.run(command, capture_output=True, text=True, timeout=STATUS_WITHIN_S, check=False)
    after = os.times()
    took = Took(
        round(time.monotonic() - began_s, 2),
        round(after.children_user - before.children_user + after.children_system - before.children_system, 2),
    )
    return took, json.loads(done.stdout) if done.stdout else {"problems": [done.stderr], "components": []}


def kind_of(process: psutil.Process) -> str:
    """Return the kind of a process: its name without numbers; an ARC's name begins with that of its watcher."""
    name = re.sub(r"^watch-scout\d+(-?)", lambda found: "ARC" if found[1] else "watcher", name_of(process))
    return "ARC" if name.startswith("ARC") else re.sub(r"[-\d]+$", "", name)


def busy(processes: Sequence[psutil.Process]) -> dict[int, tuple[str, float]]:
    """Return the kind and processor time of each process that still exists."""
    found = {}
    for process in processes:
        try:
            found[process.pid] = kind_of(process), busy_s([process])
        except (psutil.NoSuchProcess, FileNotFoundError):
            continue
    return found


def memory(processes: Sequence[psutil.Process]) -> dict[str, Any]:
    """Return the proportional memory and the threads of all processes together."""
    pss_bytes, threads, by_kind = 0, 0, Counter[str]()
    for process in processes:
        try:
            own = process.memory_full_info().pss
            pss_bytes, threads = pss_bytes + own, threads + process.num_threads()
            by_kind[kind_of(process)] += own
        except (psutil.NoSuchProcess, FileNotFoundError):
            continue
    return {
        "pss_mb": round(pss_bytes / 1e6),
        "pss_mb_by_kind": {kind: round(each / 1e6) for kind, each in by_kind.most_common()},
        "threads": threads,
        "processes": len(processes),
    }


def cores_by_kind(
    before: dict[int, tuple[str, float]], after: dict[int, tuple[str, float]], took_s: float
) -> dict[str, Any]:
    """Return the shares of a core that the processes used, in total and by kind."""
    by_kind: dict[str, float] = defaultdict(float)
    for pid, (kind, then_s) in after.items():
        by_kind[kind] += (then_s - before.get(pid, ("", 0.0))[1]) / took_s
    percent = {kind: round(100 * share, 1) for kind, share in sorted(by_kind.items(), key=lambda one: -one[1])}
    return {"core_percent": round(sum(percent.values())), "core_percent_by_kind": percent}


async def numbers_of(bus: Bus, address: str) -> dict[str, float]:
    """Return a component's statistics; empty if it does not answer."""
    try:
        return (await bus.ask(address, AskStatistics(), Statistics, within_s=2)).values
    except BackboneError:
        return {}


def total(numbers: Sequence[dict[str, float]], name: str) -> float:
    """Return the sum of one statistic over components; a component that did not answer counts 0."""
    return sum(one.get(name, 0.0) for one in numbers)


async def questions_s(bus: Bus, seconds: float) -> list[float]:
    """Return the durations of bare questions over so many seconds."""
    found, ends_s = [], time.monotonic() + seconds
    while time.monotonic() < ends_s:
        began_s = time.perf_counter()
        with suppress(BackboneError):  # then it took long
            await bus.ask(RC_MANAGER, AskState(), ComponentState, within_s=5)
        found.append(time.perf_counter() - began_s)
        await asyncio.sleep(ASK_EVERY_S)
    return found


async def take_over(robot: str, number: int) -> float:
    """Attach to a robot as a console does, turn it, release it; return the seconds until it obeyed."""
    joining = await join(Where(NAME, None, None), {"robot": robot, "kind": "drive", "priority": 100})
    launch, clock = msgspec.structs.replace(joining.launch, name=f"console-{number}"), joining.clock
    events: list[ConsoleEvent] = []

    async def drive(console: Teleoperation) -> None:
        await console.wait_granted()
        await console.do(DriveWish(6, -6))
        await clock.sleep_s(0.1)
        await console.do(DriveWish(0, 0))
        await console.give_back()

    own = await joining.open_bus(launch)
    async with asyncio.timeout(TAKE_OVER_WITHIN_S):
        await Teleoperation(launch, own, clock, show=events.append, work=drive, watches=False).run()
    asked = next(event.at_s for event in events if isinstance(event, Asked))
    return next(event.at_s for event in events if isinstance(event, CommandApplied)) - asked


async def measure(running: RealMission, scouts: int, seconds: float, take_overs: int, trace: Path) -> dict[str, Any]:
    """Measure switches, pictures, processor time and take-overs of a mission that is up."""
    grabbers = [f"resource_pool/grabber{number}" for number in range(1, (scouts - 1) // SHARING + 2)]
    async with connected(NAME, None, "ui_console/bench") as (bus, clock):

        async def pictures() -> list[dict[str, float]]:
            return await asyncio.gather(*(numbers_of(bus, grabber) for grabber in grabbers))

        since_s = clock.now_s()
        began_s, before, first = time.monotonic(), busy(own_processes(running)), await pictures()
        questions = await questions_s(bus, seconds)
        then, after = await pictures(), busy(own_processes(running))
        took_s = time.monotonic() - began_s
        taken = total(then, "frames_delivered") - total(first, "frames_delivered")
        until_s = clock.now_s()
        await clock.sleep_s(2 * SETTLE_S + 1)  # the last switch is over
    took: list[float | str] = []
    for number in range(1, take_overs + 1):
        try:
            took.append(round(1000 * await take_over(f"scout{number % scouts + 1}", number)))
        except (BackboneError, TimeoutError, StopIteration) as error:
            took.append(f"{type(error).__name__}: {error}")
    switches = switches_s(trace, since_s, until_s, SETTLE_S) or [0.0]
    return {
        **cores_by_kind(before, after, took_s),
        "switches": len(switches),
        "switch_p50_ms": round(1000 * percentile(switches, 0.5), 1),
        "switch_p99_ms": round(1000 * percentile(switches, 0.99), 1),
        "take_over_ms": took,
        "pictures_hz": round(taken / took_s / len(grabbers), 2),
        "pictures_allowed_hz": round(total(then, "pictures_allowed_hz") / len(grabbers), 2),
        "floor": "one question to the RC manager through the hub, in the same mission",
        "floor_p50_ms": round(1000 * percentile(questions, 0.5), 2),
        "floor_p99_ms": round(1000 * percentile(questions, 0.99), 2),
    }


def listed_in_time(scouts: int) -> dict[str, Any]:
    """Ask for the status until it lists all components; return the first and the last answer's figures."""
    expected, began_s = components(scouts), time.monotonic()
    ends_s = began_s + WHOLE_WITHIN_S
    at_once, found = status()
    took, first = at_once, len(found["components"])
    while len(found["components"]) < expected and time.monotonic() < ends_s:
        took, found = status()
    return {
        "components": expected,
        "listed_at_once": first,
        "listed": len(found["components"]),
        "listed_after_s": round(time.monotonic() - began_s, 2),
        "status_at_once": at_once._asdict(),
        "status": took._asdict(),
        "absent": found.get("absent", [])[:3],
        "problems": found["problems"][:3],
    }


def one_size(scouts: int, given: argparse.Namespace) -> None:
    """Measure one size and print its line."""
    with tempfile.TemporaryDirectory() as folder:
        trace, began_s = Path(folder) / "trace.jsonl", time.monotonic()
        mission = mission_file(scouts, given.pictures, given.slices)
        with mission_up(mission, "--trace", str(trace), *given.up, name=NAME) as running:
            ready_s = time.monotonic() - began_s
            began = cores_by_kind({}, busy(own_processes(running)), 1.0)
            listed = listed_in_time(scouts)
            measured = asyncio.run(measure(running, scouts, given.seconds, given.take_overs, trace))
            held, later = memory(own_processes(running)), status()[0]
        report(
            "scale",
            scouts=scouts,
            asked_pictures_hz=given.pictures,
            up=given.up,
            ready_s=round(ready_s, 2),
            ready_processor_s=began["core_percent"] / 100,
            ready_processor_percent_s_by_kind=began["core_percent_by_kind"],
            **listed,
            status_later=later._asdict(),
            **measured,
            **held,
            ended=running.lines[-1],
        )


def main() -> None:
    """Measure each size and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scouts", nargs="*", type=int, default=SIZES)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--pictures", type=float, default=15.0, help="a second, of each grabber")
    parser.add_argument("--slices", type=float, default=5.0, help="minimum run time of a watcher, seconds")
    parser.add_argument("--take-overs", type=int, default=5)
    parser.add_argument("--up", action="append", default=[], help="an option for 'up', as in --up=--pack=4")
    given = parser.parse_args()
    for scouts in given.scouts:
        free_mb = psutil.virtual_memory().available / 1e6
        if free_mb < scouts * MOST_MB_A_SCOUT:
            report("scale", scouts=scouts, not_begun=f"{free_mb:.0f} MB of memory are free")
            continue
        one_size(scouts, given)


if __name__ == "__main__":
    main()
