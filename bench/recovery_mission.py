"""A real mission for faults, watched from another process.

Rule of this file: it never judges. ``recovery_verdict`` judges the observations.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
from measuring import BIN, MISSION_XML, helper
from missions import RealMission, mission_up

from mission_control.laboratory.module_kit.real_mission import MARK, wait_gone

CONSOLE_ROBOT = "scout3"
OBSERVER = Path(__file__).with_name("recovery_observer.py")
POLL_S = 0.02
GONE_WITHIN_S = 5.0  # chosen: the aim for a mission whose launcher is gone


class NotSeen(Exception):
    """An expected state did not come in time."""


@dataclass(frozen=True, slots=True)
class Look:
    """An observation of the mission.

    Attributes:
        began_s: Begin of the observation, monotonic clock of the machine.
        at_s: Arrival of its answer.
        sight: The observed state; see ``recovery_observer.sight``.
    """

    began_s: float
    at_s: float
    sight: dict[str, Any]

    @property
    def word(self) -> str:
        """Health as printed by ``status``."""
        return str(self.sight["word"])

    @property
    def rows(self) -> dict[str, Any]:
        """Process and state by the component's name; empty: the nameserver did not answer."""
        found: dict[str, Any] = self.sight.get("rows", {})
        return found

    def pid(self, name: str) -> int:
        """Return the process of a component; 0 if it is not listed."""
        return int(self.rows.get(name, [0])[0])

    def ready(self) -> set[str]:
        """Return the names of components that are ready."""
        return {name for name, (_, state) in self.rows.items() if state == "ready"}


@dataclass
class Watch:
    """The growing observations of an observer in its own process.

    Attributes:
        process: The observer.
        origin_s: Time at which the mission's clock was 0, monotonic clock of the machine.
        pictures_s: Arrivals of pictures.
    """

    process: subprocess.Popen[bytes]
    origin_s: float = 0.0
    looks: list[Look] = field(default_factory=list)
    pictures_s: list[float] = field(default_factory=list)

    def read(self) -> None:
        """Read lines until the observer ends."""
        assert self.process.stdout is not None
        sight: dict[str, Any] = {}
        for line in self.process.stdout:
            said = json.loads(line)
            if "frame" in said:
                self.pictures_s.append(said["frame"])
            elif "origin" in said:
                self.origin_s = said["origin"]
            else:
                sight = said.get("sight", sight)
                self.looks.append(Look(said["began"], said["t"], sight))

    def wait(self, what: str, holds: Callable[[Look], bool], within_s: float) -> Look:
        """Wait for a look that fulfills the condition, and return it.

        Raises:
            NotSeen: No look fulfilled it in time.
        """
        ends_s = time.monotonic() + within_s
        while time.monotonic() < ends_s:
            if self.looks and holds(self.looks[-1]):
                return self.looks[-1]
            time.sleep(POLL_S)
        raise NotSeen(f"not within {within_s:g} s: {what}; last seen: {self.looks[-1].sight if self.looks else None}")


class BenchMission:
    """A mission that is up, and its observations.

    Args:
        trace: File of its scheduling decisions.
    """

    def __init__(self, running: RealMission, watch: Watch, trace: Path) -> None:
        self.running, self.watch, self.trace = running, watch, trace
        self.console: subprocess.Popen[bytes] | None = None

    def attach_console(self) -> int:
        """Let a person of priority 100 take a robot and hold it; return the console's process."""
        self.detach_console()
        words = ["attach", CONSOLE_ROBOT, "--priority", "100", "--script", "-", "--mission", self.running.name]
        self.console = subprocess.Popen(
            [str(BIN / "scout-console"), *words],
            env=self.running.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.watch.wait("the console holds its robot", lambda look: bool(console_arcs(look)), 20.0)
        return self.console.pid

    def detach_console(self) -> None:
        """Close the console if there is one."""
        if self.console is None:
            return
        assert self.console.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.console.stdin.close()
        try:
            self.console.wait(GONE_WITHIN_S)
        except subprocess.TimeoutExpired:
            self.console.kill()
            self.console.wait()
        self.console = None

    def left(self) -> list[psutil.Process]:
        """Return its remaining processes after at most ``GONE_WITHIN_S``."""
        return wait_gone(self.running.environment[MARK], GONE_WITHIN_S)

    def processes(self, look: Look) -> dict[str, int]:
        """Return victim, zygotes included → process; empty if the look has no rows."""
        if not look.rows:
            return {}
        found = {name: look.pid(name) for name in look.rows if look.pid(name)}
        found["core_zygote"] = self.zygote_of(self.running.launcher.pid, look)
        found["zygote"] = self.zygote_of(found.get("creator-base", 0), look)
        return {name: pid for name, pid in found.items() if pid}

    def zygote_of(self, keeper_pid: int, look: Look) -> int:
        """Return the process that forks components for this one; 0 if there is none."""
        rows = {pid for pid, _ in look.rows.values()}
        with contextlib.suppress(psutil.Error):
            for child in psutil.Process(keeper_pid).children():
                if child.pid not in rows and child.status() != psutil.STATUS_ZOMBIE:
                    return child.pid
        return 0


def console_arcs(look: Look) -> list[str]:
    """Return the ARCs of a console that hold RCs."""
    return [arc for arc in look.sight.get("held", []) if arc.endswith("-drive")]


@contextlib.contextmanager
def observed_mission() -> Iterator[BenchMission]:
    """Bring a mission up and observe it until the block ends."""
    with tempfile.TemporaryDirectory(prefix="scout-bench-") as folder:
        trace = Path(folder) / "trace.jsonl"
        with (
            mission_up(MISSION_XML, "--trace", str(trace)) as running,
            helper(str(OBSERVER), running.name, answers=True) as observer,
        ):
            watch = Watch(observer)
            reader = threading.Thread(target=watch.read)
            reader.start()
            mission = BenchMission(running, watch, trace)
            try:
                yield mission
            finally:
                mission.detach_console()
                assert observer.stdin is not None
                observer.stdin.close()
                reader.join()
