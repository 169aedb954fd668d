"""A real mission for faults: started and ended by the real command line, watched from another process.

Rule of this file: it never judges. ``recovery_verdict`` judges the observations.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
from measuring import BIN, MISSION_XML

from mission_control.laboratory.module_kit.real_mission import MARK, marked, wait_gone

CONSOLE_ROBOT = "scout3"
COMMAND_WITHIN_S = 60.0
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
        looks: Its looks.
        pictures_s: Arrivals of pictures.
    """

    process: subprocess.Popen[str]
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


@dataclass
class BenchMission:
    """A mission that is coming up or is up.

    Attributes:
        name: Its name.
        environment: Environment for further commands.
        launcher: The ``up`` process.
        watch: The observations of the mission.
        trace: File of its scheduling decisions.
        lines: The output of ``up``.
    """

    name: str
    environment: dict[str, str]
    launcher: subprocess.Popen[str]
    watch: Watch
    trace: Path
    lines: list[str] = field(default_factory=list)
    console: subprocess.Popen[str] | None = None

    @property
    def directory(self) -> Path:
        """Its run folder."""
        return Path(self.environment["XDG_RUNTIME_DIR"]) / "scout-backbone" / self.name

    def command(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run one of the command lines beside it."""
        return subprocess.run(
            [str(BIN / words[0]), *words[1:], "--mission", self.name],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=COMMAND_WITHIN_S,
            check=False,
        )

    def attach_console(self) -> int:
        """Let a person of priority 100 take a robot and hold it; return the console's process."""
        self.detach_console()
        words = ["attach", CONSOLE_ROBOT, "--priority", "100", "--script", "-", "--mission", self.name]
        self.console = subprocess.Popen(
            [str(BIN / "scout-console"), *words],
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
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

    def down(self) -> subprocess.CompletedProcess[str]:
        """Take the mission down by command."""
        return self.command("scout-backbone", "down")

    def left(self) -> list[psutil.Process]:
        """Return its remaining processes after at most ``GONE_WITHIN_S``."""
        return wait_gone(self.environment[MARK], GONE_WITHIN_S)

    def processes(self, look: Look) -> dict[str, int]:
        """Return victim, zygotes included → process; empty if the look has no rows."""
        if not look.rows:
            return {}
        found = {name: look.pid(name) for name in look.rows if look.pid(name)}
        found["core_zygote"] = self.zygote_of(self.launcher.pid, look)
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
def mission_coming_up() -> Iterator[BenchMission]:
    """Start a mission and an observer; at the end of the block kill the remaining processes."""
    with tempfile.TemporaryDirectory(prefix="scout-bench-") as folder:
        mark = uuid.uuid4().hex
        name = f"bench-{mark[:8]}"
        text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{name}", MISSION_XML.read_text(), count=1)
        file, trace = Path(folder) / "mission.xml", Path(folder) / "trace.jsonl"
        file.write_text(text)
        plain = {**os.environ, "XDG_RUNTIME_DIR": folder}
        environment = {**plain, MARK: mark}
        observer = subprocess.Popen(
            [sys.executable, str(Path(__file__).parent / "recovery_observer.py"), name],
            env=plain,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        launcher = subprocess.Popen(
            [str(BIN / "scout-backbone"), "up", str(file), "--headless", "--trace", str(trace)],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        mission = BenchMission(name, environment, launcher, Watch(observer), trace)
        readers = [threading.Thread(target=mission.watch.read), threading.Thread(target=_read, args=(mission,))]
        for reader in readers:
            reader.start()
        try:
            yield mission
        finally:
            _clean_up(mission, readers)


def _clean_up(mission: BenchMission, readers: list[threading.Thread]) -> None:
    for process in marked(mission.environment[MARK]):
        with contextlib.suppress(psutil.Error):
            process.send_signal(signal.SIGKILL)
    mission.launcher.wait()
    if mission.console is not None:
        mission.console.wait()
    assert mission.watch.process.stdin is not None
    mission.watch.process.stdin.close()
    try:
        mission.watch.process.wait(GONE_WITHIN_S)
    except subprocess.TimeoutExpired:
        mission.watch.process.kill()
        mission.watch.process.wait()
    for reader in readers:
        reader.join()
    for stream in (mission.watch.process.stdout, mission.launcher.stderr):
        assert stream is not None
        stream.close()


def _read(mission: BenchMission) -> None:
    assert mission.launcher.stderr is not None
    mission.lines.extend(line.rstrip() for line in mission.launcher.stderr)
