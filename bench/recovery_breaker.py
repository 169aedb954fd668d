"""The victims of a mission, the faults for them, and the loop that waits for the recovery."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from typing import Any

import psutil
from recovery_mission import POLL_S, BenchMission, NotSeen, observed_mission
from recovery_trace import violations
from recovery_verdict import Expected, Fault, Judgement, longest_gap_s

from backbone.creator.process_table import is_stopped
from mission_control.laboratory.module_kit.real_mission import MARK, marked

WATCHERS = frozenset({"watch-scout1-capture", "watch-scout2-capture"})
HARDWARE = ("radio", "scout1", "scout2", "scout3", "video1")
ROWS: dict[str, tuple[str, ...]] = {
    "nameserver": ("nameserver",),
    "component_database": ("component_database",),
    "placer": ("placer",),
    "creator": ("creator-base",),
    "dependency_database": ("dependency_database",),
    "rc_manager": ("rc_manager",),
    "core_zygote": ("nameserver", "component_database", "placer", "creator-base", "dependency_database", "rc_manager"),
    "zygote": ("grabber", "world", "surveillance", *HARDWARE),
    "hardware": HARDWARE,
    "grabber": ("grabber",),
    "world": ("world",),
    "arc": ("watch-scout1-capture",),
    "behavior": ("watch-scout1",),
    "parent": ("surveillance",),
    "console": (),
    "launcher": ("launcher",),
}
"""Victims, and the components that live in their process or end with it."""
SIGNALS = {"SIGKILL": signal.SIGKILL, "SIGTERM": signal.SIGTERM}
STOPS_S = {f"SIGSTOP {stop:g}": stop for stop in (0.3, 1.0, 5.0, 30.0)}
FAULTS = (*SIGNALS, *STOPS_S)
CALM_S = 6.0  # chosen: longer than a turn, so that the usual gap of pictures at a switch is seen
STAYS_S = 2.0  # chosen: twice ``GONE_AFTER_S`` of a peer monitor
MENDED_WITHIN_S = 40.0  # chosen: a fault that lasts longer counts as not mended
DOWN_WITHIN_S = 30.0
SHOWN = 5  # number of violations that are printed in full


class Breaker:
    """Injects faults into a mission that is up, and reports the effects."""

    def __init__(self, mission: BenchMission, patience_s: float) -> None:
        self.mission, self.watch, self.patience_s = mission, mission.watch, patience_s
        self.struck: list[Fault] = []

    def calm(self) -> Expected:
        """Return the state of the mission without faults."""
        look = self.watch.wait(
            "everything runs", lambda look: look.sight.get("asks", []) >= sorted(WATCHERS) and look.word == "ok", 30.0
        )
        time.sleep(CALM_S)
        look = self.watch.looks[-1]
        return Expected(look, frozenset(n for n in look.ready() if not n.startswith(("cli-", "console"))), WATCHERS)

    def fault(self, victim: str, name: str) -> Fault:
        """Return the fault of the victim's present process.

        Raises:
            NotSeen: The victim does not run now.
        """
        if victim == "console":
            return Fault(victim, name, self.mission.attach_console(), ())
        rows = ROWS[victim]
        look = self.watch.wait(f"{victim} runs", lambda look: "rows" in look.sight, 20.0)
        pid = self.mission.processes(look).get(victim if victim.endswith("zygote") else rows[0], 0)
        if not pid:
            raise NotSeen(f"{victim} does not run")
        return Fault(victim, name, pid, rows)

    def strike(self, fault: Fault) -> None:
        """Inject the fault."""
        fault.at_s = time.monotonic()
        self.struck.append(fault)
        with contextlib.suppress(ProcessLookupError):
            os.kill(fault.pid, SIGNALS.get(fault.name, signal.SIGSTOP))
        if fault.kills:
            fault.lifted_s = fault.at_s
        if fault.victim.endswith("zygote") and fault.name == "SIGTERM":
            time.sleep(POLL_S)
            if any(process.pid == fault.pid for process in marked_of(self.mission)):
                fault.replaced_s = fault.at_s  # a zygote ignores the signal

    def attend(self, fault: Fault) -> None:
        """Continue a stopped process when its time has come; check whether a zygote was replaced."""
        now_s = time.monotonic()
        if fault.lifted_s == math.inf and fault.victim.endswith("zygote") and not is_stopped(fault.pid):
            fault.lifted_s = now_s  # its parent continued it
        if fault.lifted_s == math.inf and now_s >= fault.at_s + STOPS_S[fault.name]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(fault.pid, signal.SIGCONT)
            fault.lifted_s = now_s
        if fault.victim.endswith("zygote") and fault.replaced_s == math.inf and self.watch.looks:
            look = self.watch.looks[-1]
            keeper_pid = (
                self.mission.running.launcher.pid if fault.victim == "core_zygote" else look.pid("creator-base")
            )
            if "rows" in look.sight and self.mission.zygote_of(keeper_pid, look) not in (0, fault.pid):
                fault.replaced_s = now_s

    def see_through(self, expected: Expected, fault: Fault) -> dict[str, Any]:
        """Inject the fault, wait until the mission has lastingly recovered, and return the observations."""
        usual_gap_s = longest_gap_s(self.watch.pictures_s, expected.before.at_s - CALM_S, expected.before.at_s)
        more = len(marked_of(self.mission))
        self.strike(fault)
        judgement = Judgement(expected, fault)
        while True:
            time.sleep(POLL_S)
            self.attend(fault)
            judgement.take(self.watch.looks, self.watch.pictures_s)
            lifted_s, now_s = fault.lifted_s, time.monotonic()
            if now_s > max(lifted_s, judgement.good_since_s) + STAYS_S or now_s > lifted_s + self.patience_s:
                break
        look = self.watch.looks[-1]
        found: dict[str, Any] = {
            "noticed_s": rounded(judgement.noticed_after_s()),
            "healthy_s": rounded(judgement.healthy_after_s()),
            "unsaid_s": rounded(judgement.unsaid_s),
            "gap_s": rounded(longest_gap_s(self.watch.pictures_s, fault.at_s, time.monotonic())),
            "usual_gap_s": rounded(usual_gap_s),
            "more": len(marked_of(self.mission)) - more,
        }
        if judgement.healthy_after_s() is None:
            found["lacks"] = judgement.lacks(look, self.watch.pictures_s)
            found["says"] = [look.word, *look.sight["why"]]
        return found

    def end(self) -> dict[str, Any]:
        """Take the mission down; return the findings of the trace and the remains of the mission."""
        self.mission.detach_console()
        done = self.mission.running.command("scout-backbone", "down", "--mission", self.mission.running.name)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.mission.running.launcher.wait(DOWN_WITHIN_S)
        return {"down": done.returncode, **self.aftermath()}

    def aftermath(self) -> dict[str, Any]:
        """Return the exit of ``up``, the remains of the mission, and the findings of the trace."""
        left = self.mission.left()
        broken, late = violations(self.mission.trace, self._pauses())
        return {
            "up_exit": self.mission.running.launcher.poll(),
            "left": len(left),
            "folder_left": self.mission.running.directory.exists(),
            "violations": len(broken),
            "late_by_pause": len(late),
            **({"violated": [str(each) for each in broken[:SHOWN]]} if broken else {}),
        }

    def _pauses(self) -> list[tuple[float, float]]:
        """Return when the RC manager was stopped and continued, on the mission's clock."""
        origin_s = self.watch.origin_s
        stopped = [fault for fault in self.struck if fault.victim == "rc_manager" and not fault.kills]
        return [(fault.at_s - origin_s, fault.lifted_s - origin_s) for fault in stopped]


def marked_of(mission: BenchMission) -> list[psutil.Process]:
    """Return the mission's processes, except its console."""
    console = mission.console.pid if mission.console is not None else 0
    return [process for process in marked(mission.running.environment[MARK]) if process.pid != console]


def rounded(seconds: float | None) -> float | None:
    """Return seconds rounded for people."""
    return None if seconds is None else round(seconds, 2)


@contextlib.contextmanager
def breaker(patience_s: float) -> Iterator[Breaker]:
    """Bring a mission up, and yield it."""
    with observed_mission() as mission:
        yield Breaker(mission, patience_s)
