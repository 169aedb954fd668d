"""A real mission for tests: started by the real command line, in a runtime folder of its own."""

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
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from backbone import run_files
from backbone.authentication import secret_of
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config

MISSION_XML = Path(__file__).parents[2] / "mission.xml"
READY_WITHIN_S = 60.0
MARK = "SCOUT_TEST_MARK"
BIN = Path(sys.executable).parent


@dataclass
class RunningMission:
    """A mission that is up.

    Attributes:
        name: Its name.
        environment: For further commands of the same runtime folder.
        launcher: The ``up`` process.
        lines: What ``up`` said so far.
    """

    name: str
    environment: dict[str, str]
    launcher: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)

    def command(
        self, *words: str, within_s: float = 60.0, stdin: str | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run ``scout-backbone`` or ``scout-console`` with these words beside the mission."""
        return subprocess.run(
            [str(BIN / words[0]), *words[1:]],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=within_s,
            input=stdin,
            check=False,
        )

    def status(self) -> dict[str, Any]:
        """Return ``status --json``."""
        done = self.command("scout-backbone", "status", "--json", "--mission", self.name)
        assert done.returncode == 0, done.stderr + self.story()
        found: dict[str, Any] = json.loads(done.stdout)
        return found

    def wait_for_watchers(self, within_s: float = 10.0) -> None:
        """Return when the children of the tree run; they come a moment after all is ready."""
        ends_s = time.monotonic() + within_s
        while not {"watch-scout1", "watch-scout2"} <= {c["name"] for c in self.status()["components"]}:
            assert time.monotonic() < ends_s, self.story()

    def component(self, name: str) -> dict[str, Any]:
        """Return one component of the status."""
        found = [c for c in self.status()["components"] if c["name"] == name]
        assert found, f"{name} is not there\n{self.story()}"
        return found[0]

    def processes(self) -> list[psutil.Process]:
        """Return every process of this mission, launcher included."""
        return marked(self.environment[MARK])

    def story(self) -> str:
        """Return what ``up`` said and the ends of all logs, for failure messages."""
        parts = ["--- up said", *self.lines[-60:]]
        with contextlib.suppress(OSError):
            for log in sorted(self.directory.glob("log/*.log")):
                parts += [f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-15:]]
        return "\n".join(parts)

    @property
    def directory(self) -> Path:
        """The mission's run directory."""
        return Path(self.environment["XDG_RUNTIME_DIR"]) / "scout-backbone" / self.name

    @property
    def endpoint(self) -> str:
        """Where its hub listens."""
        with runtime_directory(self.environment["XDG_RUNTIME_DIR"]):
            return run_files.find(self.name).endpoint

    @property
    def clock(self) -> MissionClock:
        """Its time."""
        with runtime_directory(self.environment["XDG_RUNTIME_DIR"]):
            found = run_files.find(self.name)
        return MissionClock(found.clock_origin_monotonic_s, found.clock_rate)

    @contextlib.asynccontextmanager
    async def bus(self, source: str = "ui_console/tester") -> AsyncIterator[ZenohBus]:
        """Open a bus to the mission."""
        config = client_config(self.endpoint, secret_of(str(self.directory)))
        opened = await ZenohBus.open_when_up(self.name, source, self.clock, config)
        try:
            yield opened
        finally:
            await opened.close()

    def wait_for_line(self, pattern: str, within_s: float) -> str:
        """Return the first line ``up`` said that matches."""
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            for line in list(self.lines):
                if re.search(pattern, line):
                    return line
            if self.launcher.poll() is not None:
                break
            time.sleep(0.02)
        raise AssertionError(f"no line {pattern!r} within {within_s} s\n{self.story()}")

    def down(self) -> int:
        """Take it down by command; return the exit code of ``up``."""
        done = self.command("scout-backbone", "down", "--mission", self.name)
        assert done.returncode == 0, done.stderr + self.story()
        return self.launcher.wait(30)


@contextlib.contextmanager
def runtime_directory(path: str) -> Iterator[None]:
    """Let this process look for missions in that runtime folder."""
    before = os.environ.get("XDG_RUNTIME_DIR")
    os.environ["XDG_RUNTIME_DIR"] = path
    try:
        yield
    finally:
        if before is None:
            del os.environ["XDG_RUNTIME_DIR"]
        else:
            os.environ["XDG_RUNTIME_DIR"] = before


def marked(mark: str) -> list[psutil.Process]:
    """Return every process whose environment carries the mark."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


@contextlib.contextmanager
def mission_up(
    *options: str,
    name: str = "",
    mission_xml: Path = MISSION_XML,
    change: dict[str, str] | None = None,
    beside: RunningMission | None = None,
) -> Iterator[RunningMission]:
    """Bring a mission up, yield it when all is ready, and make sure that nothing of it is left afterwards.

    Args:
        options: Further words for ``up``.
        name: Another mission name than the file's.
        mission_xml: The mission file.
        change: Texts to replace in the file.
        beside: Another mission of the same user; None: it has a runtime folder of its own.
    """
    with tempfile.TemporaryDirectory(prefix="scout-test-") as folder:
        mark = uuid.uuid4().hex
        name = name or f"test-{mark[:8]}"
        text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{name}", mission_xml.read_text(), count=1)
        for old, new in (change or {}).items():
            assert old in text, f"{old!r} is not in {mission_xml}"
            text = text.replace(old, new)
        file = Path(folder) / "mission.xml"
        file.write_text(text)
        runtime = folder if beside is None else beside.environment["XDG_RUNTIME_DIR"]
        environment = {**os.environ, "XDG_RUNTIME_DIR": runtime, MARK: mark}
        launcher = subprocess.Popen(
            [str(BIN / "scout-backbone"), "up", str(file), "--headless", *options],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        mission = RunningMission(name, environment, launcher)
        reader = threading.Thread(target=_read, args=(launcher, mission.lines), daemon=True)
        reader.start()
        try:
            mission.wait_for_line("^all ready", READY_WITHIN_S)
            yield mission
            if launcher.poll() is None:
                mission.down()
            left = wait_gone(mark, 3.0)
            assert not left, f"left behind: {left}\n{mission.story()}"
        finally:
            if launcher.poll() is None:
                launcher.send_signal(signal.SIGKILL)
            launcher.wait(10)
            for process in wait_gone(mark, 3.0):
                with contextlib.suppress(psutil.Error):
                    process.kill()
            reader.join(5)
            assert launcher.stderr is not None
            launcher.stderr.close()


def wait_gone(mark: str, within_s: float) -> list[psutil.Process]:
    """Return the marked processes that are still there after at most this time."""
    deadline = time.monotonic() + within_s
    while (left := marked(mark)) and time.monotonic() < deadline:
        psutil.wait_procs(left, timeout=0.1)
    return left


def _read(launcher: subprocess.Popen[str], lines: list[str]) -> None:
    assert launcher.stderr is not None
    lines.extend(line.rstrip() for line in launcher.stderr)
