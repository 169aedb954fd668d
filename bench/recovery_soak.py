"""Many faults, one after the other, in one mission: its state at the end, and the growth of its processes.

The usage of each process is measured after a first part of the same faults, and again at the end. Each time all links
were lost and regained just before, and the minimum over some seconds counts, because links start and end threads. A
process has grown if it uses more at the end than ever in the first part. The first part is long, because lives differ
in age: a framegrabber fills its stores for three minutes; a nameserver grows by a seventh over the first seventy lives
that end beside it, and then stays (measured: 21.3 MB at first, 24.6 after 72, 24.6 after 120). A second life differs
from the first: it is not forked from a fresh zygote, it watches what it found instead of what it started, and its link,
once lost and regained, keeps three descriptors more.
"""

from __future__ import annotations

import contextlib
import random
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import psutil
from measuring import report
from recovery_breaker import FAULTS, HARDWARE, ROWS, STAYS_S, Breaker, breaking_calm, rounded
from recovery_mission import POLL_S, BenchMission, Look, NotSeen
from recovery_verdict import Expected, Fault, Judgement, longest_gap_s

UsageOfOne = dict[str, float]  # usage of a process: mb, fds, threads, log_kb
Usage = dict[str, UsageOfOne]

PAUSE_S = (5.0, 15.0)
REMEMBERED_S = 60.0  # chosen: twice the longest pause of a process
SETTLED_WITHIN_S = 60.0
GROWTH = 0.1  # largest allowed growth of a process
FEW_THREADS = 2  # chosen: worker threads start when there is work for them
WARM_UP_S = 720.0  # measured: some seventy lives end in that time
LOOKED_AT_S = 20.0  # measured: worker threads of a link end some ten seconds after the load that started them
LOG_KB = 2 * 1024 + 256  # a log and its predecessor, each a little over its size


def soak(minutes: float, seed: int, victims: Sequence[str]) -> None:
    """Inject random faults into a mission for ``minutes``, and print its health and growth afterwards."""
    rng = random.Random(seed)
    with breaking_calm() as (breaking, expected):
        most: Usage = {}
        end_each_once(breaking, expected)
        judgement = Judgement(expected, [])
        strike(breaking, judgement, rng, victims, WARM_UP_S, most)
        before = relinked_usage(breaking, judgement)
        faults = strike(breaking, judgement, rng, victims, minutes * 60, {})
        after = relinked_usage(breaking, judgement)
        began_s, mission = expected.before.at_s, breaking.mission
        look = breaking.watch.looks[-1]
        end = {
            "word": look.word,
            "lacks": judgement.lacks(look, breaking.watch.pictures_s),
            "says": look.sight["why"],
            "unsaid_s": rounded(judgement.unsaid_s),
            "gap_s": rounded(longest_gap_s(breaking.watch.pictures_s, began_s, time.monotonic())),
        }
        mission.detach_console()
        for name in sorted(before):
            report("recovery_soak_usage", **compared(name, before[name], most.get(name, {}), after.get(name, {})))
        report("recovery_soak", faults=faults, minutes=minutes, seed=seed, **end, **breaking.end())


def strike(
    breaking: Breaker, judgement: Judgement, rng: random.Random, victims: Sequence[str], for_s: float, most: Usage
) -> int:
    """Inject random faults for ``for_s``; return how many. ``most`` then holds the peak usage of each process."""
    ends_s = time.monotonic() + for_s
    began_s = judgement.expected.before.at_s
    faults: list[Fault] = []
    while time.monotonic() < ends_s:
        fault = drawn(breaking, rng, victims)
        if fault is not None:
            faults.append(fault)
            judgement.faults = [f for f in faults if f.lifted_s > time.monotonic() - REMEMBERED_S]
            report("recovery_soak", at_s=rounded(fault.at_s - began_s), **done_to(fault))
        wait(breaking, judgement, time.monotonic() + rng.uniform(*PAUSE_S))
        for name, now in usage(breaking.mission, breaking.watch.looks[-1]).items():
            known = most.setdefault(name, now)
            most[name] = {kind: max(known[kind], value) for kind, value in now.items()}
    return len(faults)


def end_each_once(breaking: Breaker, expected: Expected) -> None:
    """Kill each process except the launcher, one after the other, and await its return; then cut all links once."""
    for victim in (*ROWS, "nameserver"):
        if victim != "launcher":
            found = breaking.see_through(expected, [breaking.fault(victim, "SIGKILL")])
            report("recovery_soak", warms_up=victim, healthy_s=found["healthy_s"])


def drawn(breaking: Breaker, rng: random.Random, victims: Sequence[str]) -> Fault | None:
    """Inject a random fault into a random process; return it, or None if there was no such process."""
    victim = rng.choice(victims)
    name = rng.choice([each for each in FAULTS if victim != "launcher" or each.startswith("SIGSTOP")])
    try:
        fault = breaking.fault(victim, name)
    except NotSeen as error:
        report("recovery_soak", victim=victim, fault=name, skipped=str(error)[:200])
        return None
    breaking.strike([fault])
    return fault


def done_to(fault: Fault) -> dict[str, Any]:
    """Return the fault for a report."""
    return {"victim": fault.victim, "fault": fault.name, "pid": fault.pid}


def wait(breaking: Breaker, judgement: Judgement, until_s: float) -> None:
    """Wait; continue stopped processes when their time has come."""
    while time.monotonic() < until_s:
        time.sleep(POLL_S)
        for fault in judgement.faults:
            breaking.attend(fault)
        if judgement.faults:
            judgement.take(breaking.watch.looks, breaking.watch.pictures_s)


def settle(breaking: Breaker, judgement: Judgement) -> None:
    """Return when the mission has lastingly recovered, or its time is over."""
    ends_s = time.monotonic() + SETTLED_WITHIN_S
    while time.monotonic() < ends_s:
        wait(breaking, judgement, time.monotonic() + STAYS_S / 4)
        on_the_way = any(fault.lifted_s > time.monotonic() for fault in judgement.faults)
        if not on_the_way and time.monotonic() > judgement.good_since_s + STAYS_S:
            return


def relinked_usage(breaking: Breaker, judgement: Judgement) -> Usage:
    """Cut all links once more, wait for recovery, and return the least usage of each process over some seconds."""
    settle(breaking, judgement)
    fault = breaking.fault("nameserver", "SIGKILL")
    breaking.strike([fault])
    judgement.faults = [*judgement.faults, fault]
    settle(breaking, judgement)
    least: Usage = {}
    ends_s = time.monotonic() + LOOKED_AT_S
    while time.monotonic() < ends_s:
        wait(breaking, judgement, time.monotonic() + 1.0)
        for name, now in usage(breaking.mission, breaking.watch.looks[-1]).items():
            known = least.setdefault(name, now)
            least[name] = {kind: min(known[kind], value) for kind, value in now.items()}
    return least


def usage(mission: BenchMission, look: Look) -> Usage:
    """Return the usage of each process, and the length of its log, by the name of a component in it."""
    logs, found, seen = mission.logs(), Usage(), set[int]()
    for name, pid in mission.processes(look).items():
        if pid in seen:
            continue
        seen.add(pid)
        with contextlib.suppress(psutil.Error, OSError):
            process = psutil.Process(pid)
            shared = "hardware" if name in HARDWARE else name
            found[shared] = {
                "mb": round(anonymous_kb(pid) / 1e3, 1),
                "fds": process.num_fds(),
                "threads": process.num_threads(),
                "log_kb": round(logs.get(f"{shared}.log", 0) / 1e3, 1),
            }
    return found


def anonymous_kb(pid: int) -> int:
    """Return the anonymous memory of a process, including the part that it shares with its zygote.

    When a zygote dies, shared memory becomes a process's own; this measure does not change then.
    """
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon:"))


def compared(name: str, before: UsageOfOne, most: UsageOfOne, after: UsageOfOne) -> dict[str, Any]:
    """Return the usage of a process before and after, and which of it has grown by more than ``GROWTH``.

    A log grows with each reported fault; it counts as grown only if it is longer than logs may be.

    Args:
        most: The largest usage of the process in the first part.
    """
    both = {kind: [before[kind], after.get(kind)] for kind in before}
    bound = {kind: max(was, most.get(kind, was)) * (1 + GROWTH) for kind, was in before.items()} | {"log_kb": LOG_KB}
    bound["threads"] = max(bound["threads"], before["threads"] + FEW_THREADS)
    grown = [kind for kind, (_, now) in both.items() if now is not None and now > bound[kind]]
    return {"process": name, **both, "most_before": most, "grown": grown}
