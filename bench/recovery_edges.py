"""Faults while a mission comes up, and while it goes down."""

from __future__ import annotations

import contextlib
import math
import subprocess
import threading
import time
from typing import Any, Literal

from recovery_breaker import (
    DOWN_WITHIN_S,
    MENDED_WITHIN_S,
    ROWS,
    UP_WITHIN_S,
    WATCHERS,
    Breaker,
    breaking_calm,
    rounded,
)
from recovery_mission import POLL_S, BenchMission, NotSeen, mission_coming_up
from recovery_verdict import Fault

During = Literal["up", "down"]
DURING: tuple[During, ...] = ("up", "down")
INTO_DOWN_S = 0.05  # chosen: the order to go down is on its way, and most components still run


def try_edge(during: During, victim: str, fault: str, patience_s: float = MENDED_WITHIN_S) -> dict[str, Any]:
    """Inject a fault while the mission comes up or goes down; return the effects."""
    return struck_coming_up(victim, fault, patience_s) if during == "up" else struck_going_down(victim, fault)


def struck_coming_up(victim: str, name: str, patience_s: float) -> dict[str, Any]:
    """Inject as soon as the victim runs; the mission comes up whole, or ends with a code and leaves nothing.

    Raises:
        NotSeen: The victim never ran.
    """
    with mission_coming_up() as mission:
        breaking = Breaker(mission, patience_s)
        fault = first_seen(breaking, victim, name)
        breaking.strike([fault])
        whole_s, ends_s = math.inf, time.monotonic() + patience_s + UP_WITHIN_S
        while time.monotonic() < ends_s and mission.launcher.poll() is None and whole_s == math.inf:
            time.sleep(POLL_S)
            breaking.attend(fault)
            if is_up(mission):
                whole_s = breaking.watch.looks[-1].at_s
        up: dict[str, Any] = {"up_in_s": rounded(None if whole_s == math.inf else whole_s - fault.at_s)}
        while fault.lifted_s == math.inf:
            time.sleep(POLL_S)
            breaking.attend(fault)
        up["said"] = mission.lines[-3:] if whole_s == math.inf else []
        return {**up, **(breaking.end() if mission.launcher.poll() is None else breaking.aftermath())}


def first_seen(breaking: Breaker, victim: str, name: str) -> Fault:
    """Return the fault of the victim, as soon as the victim runs.

    Raises:
        NotSeen: The victim never ran.
    """
    if victim == "console":
        raise NotSeen("a console comes to a mission that is up")
    ends_s = time.monotonic() + UP_WITHIN_S
    while time.monotonic() < ends_s:
        looks = breaking.watch.looks
        if looks and "rows" in looks[-1].sight:
            pids = breaking.mission.processes(looks[-1])
            pid = pids.get(victim if victim.endswith("zygote") else ROWS[victim][0], 0)
            if pid:
                return Fault(victim, name, pid, ROWS[victim])
        time.sleep(POLL_S)
    raise NotSeen(f"{victim} never ran")


def is_up(mission: BenchMission) -> bool:
    """Return whether ``up`` reported ready, all components run and health is ``ok``."""
    look = mission.watch.looks[-1]
    said = any(line.startswith("all ready") for line in list(mission.lines))
    return said and look.word == "ok" and frozenset(look.sight["asks"]) >= WATCHERS and bool(mission.watch.pictures_s)


def struck_going_down(victim: str, name: str) -> dict[str, Any]:
    """Inject just after ``down`` was ordered; the mission ends, logs the order, and leaves nothing."""
    with breaking_calm() as (breaking, _expected):
        mission, fault = breaking.mission, breaking.fault(victim, name)
        ordered_s = time.monotonic()
        codes: list[int] = []
        ordering = threading.Thread(target=lambda: codes.append(ordered(mission)))
        ordering.start()
        while mission.launcher.poll() is None and not says_so(mission) and time.monotonic() < ordered_s + DOWN_WITHIN_S:
            time.sleep(INTO_DOWN_S / 10)
        time.sleep(INTO_DOWN_S)
        breaking.strike([fault])
        while mission.launcher.poll() is None and time.monotonic() < ordered_s + 2 * DOWN_WITHIN_S:
            time.sleep(POLL_S)
            breaking.attend(fault)
        down_s = time.monotonic() - ordered_s
        ordering.join()
        with contextlib.suppress(subprocess.TimeoutExpired):
            mission.detach_console()
        return {"down_in_s": rounded(down_s), "down": codes[0], **breaking.aftermath()}


def says_so(mission: BenchMission) -> bool:
    """Return whether the launcher has received the order to go down."""
    return any("ends it: by command" in line for line in list(mission.lines))


def ordered(mission: BenchMission) -> int:
    """Take the mission down; return the exit code of the command, -1 if it did not end."""
    try:
        return mission.down().returncode
    except subprocess.TimeoutExpired:
        return -1
