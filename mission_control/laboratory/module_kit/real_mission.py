"""A real mission for tests, started by the real command line in its own runtime folder.

Its hub listens on a socket in that folder, so it conflicts with no other mission and needs no free port.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import psutil

from backbone import run_files
from backbone.authentication import secret_of
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.command_line.status import picture_without_hub
from backbone.errors import BackboneError, LinkError
from backbone.operating_system.memory_folder import temporary_folder
from backbone.picture.health import HealthWord
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture
from mission_control.laboratory.module_kit.virtual_mission import is_text

READY_WITHIN_S = 60.0  # chosen: enough on a machine that is busy with other tests
MARK = "SCOUT_TEST_MARK"
"""Environment variable that marks all processes of a mission."""
BIN = Path(sys.executable).parent
DOWN_WITHIN_S = 30.0  # chosen: same
GONE_WITHIN_S = 3.0  # chosen: a killed process is gone at once, on a busy machine a moment later
LOOK_EACH_S = 0.05  # chosen: a status takes a fifth of that, so that who waits leaves the processor to the mission
JsonObject = dict[str, Any]

FILES = re.compile(r"""(?:\bmjcf|\bname\s*=\s*["']floor_plan["']\s+value)\s*=\s*["'](?=[^/"'])""")
"""Begin of an attribute that names a file relative to the mission file."""
QUOTES = {'"': "&quot;", "'": "&apos;"}
_LOOKERS = itertools.count()
"""A number for each that looks, because two buses of one name would count their messages twice."""
LAST_LINES, LAST_OF_A_LOG = 60, 15  # chosen: a person reads no more of a failure


@dataclass
class RealMission:
    """A running mission.

    Attributes:
        name: Its name.
        environment: Environment for further commands in the same runtime folder.
        launcher: The ``up`` process.
        lines: Output of ``up`` so far.
        is_over: True if no more lines can arrive.
        news: Set at each line, and at the end of the output.
    """

    name: str
    environment: dict[str, str]
    launcher: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    is_over: bool = False
    news: threading.Event = field(default_factory=threading.Event)

    def command(
        self, *words: str, within_s: float = 60.0, stdin: str | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run ``scout-backbone`` or ``scout-console`` with these arguments against the mission.

        Raises:
            AssertionError: It was not over in time; with what it had printed and the mission's story.
        """
        try:
            return subprocess.run(  # noqa: S603  our own command lines
                [str(BIN / words[0]), *words[1:]],
                env=self.environment,
                capture_output=True,
                text=True,
                timeout=within_s,
                input=stdin,
                check=False,
            )
        except subprocess.TimeoutExpired as late:
            raise AssertionError(f"{late}\n{late.stdout!r}\n{late.stderr!r}\n{self.story()}") from None

    def status(self) -> JsonObject:
        """Return what ``status --json`` prints."""
        with ThreadPoolExecutor(1) as asker:  # a command takes 0.3 s to start; this thread may have a loop that runs
            try:
                picture = asker.submit(asyncio.run, self._picture()).result()
            except BackboneError as error:
                raise AssertionError(f"no status of {self.name}: {error!r}") from error
        if picture.health.word is HealthWord.FAILED:
            raise AssertionError(f"{self.name} has failed: {picture.to_json()}")
        found: JsonObject = json.loads(json.dumps(picture.to_json()))
        return found

    async def _picture(self) -> MissionPicture:
        with runtime_directory(self.environment["XDG_RUNTIME_DIR"]):
            found = run_files.find(self.name)
        try:
            async with self.bus(f"ui_console/looker-{os.getpid()}-{next(_LOOKERS)}") as bus:
                return await look(bus, self.clock.now_s(), rate=found.clock_rate)
        except LinkError as error:
            return picture_without_hub(found, error)

    def wait_for_components(self, *names: str, within_s: float = 10.0) -> None:
        """Wait until components of these names run; children of behaviors start a moment after the mission is ready."""
        ends_s = time.monotonic() + within_s
        while missing := set(names) - {component["name"] for component in self.status()["components"]}:
            if time.monotonic() > ends_s:
                raise AssertionError(f"not there within {within_s} s: {', '.join(sorted(missing))}")
            self.news.clear()
            self.news.wait(LOOK_EACH_S)

    def component(self, name: str) -> JsonObject:
        """Return the component of this name in the status."""
        found: list[JsonObject] = [c for c in self.status()["components"] if c["name"] == name]
        if not found:
            raise AssertionError(f"{name} is not there")
        return found[0]

    def processes(self) -> list[psutil.Process]:
        """Return all processes of this mission, including the launcher."""
        return marked(self.environment[MARK])

    def story(self) -> str:
        """Return the output of ``up`` and the ends of all logs, for failure messages."""
        parts = ["--- up said", *self.lines[-LAST_LINES:]]
        with contextlib.suppress(OSError):
            for log in sorted(self.directory.glob("log/*.log")):
                parts += [f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-LAST_OF_A_LOG:]]
        return "\n".join(parts)

    @property
    def directory(self) -> Path:
        """The mission's run directory."""
        return Path(self.environment["XDG_RUNTIME_DIR"]) / "scout-backbone" / self.name

    @property
    def endpoint(self) -> str:
        """Endpoint of the hub."""
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
        """Wait for a line of ``up`` that matches, and return it."""
        ends_s = time.monotonic() + within_s
        while True:
            self.news.clear()
            is_over = self.is_over
            for line in list(self.lines):
                if re.search(pattern, line):
                    return line
            if is_over or not self.news.wait(ends_s - time.monotonic()):
                raise AssertionError(f"'up' said no line {pattern!r} within {within_s} s")

    def down(self) -> int:
        """Take the mission down by command; return the exit code of ``up``."""
        done = self.command("scout-backbone", "down", "--mission", self.name)
        if done.returncode != 0:
            raise AssertionError(f"{done.args} ends with {done.returncode}: {done.stderr}")
        return self.launcher.wait(DOWN_WITHIN_S)


@contextlib.contextmanager
def runtime_directory(path: str) -> Iterator[None]:
    """Make this process look for missions in this runtime folder."""
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
    """Return all processes whose environment contains the mark."""
    found = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process)
    return found


@contextlib.contextmanager
def mission_up(
    mission: Path | str,
    *options: str,
    name: str = "",
    change: Mapping[str, str] | None = None,
    beside: RealMission | None = None,
) -> Iterator[RealMission]:
    """Bring a mission up, yield it when it is ready, and afterwards end everything that is left of it.

    Args:
        mission: Path of a mission file, or its text; relative paths in a text refer to the working directory.
        options: Further arguments for ``up``.
        name: Name of the mission; left out: a unique name.
        change: Texts to replace in the file.
        beside: Another mission whose runtime folder to share; None: a new runtime folder.
    """
    mark = uuid.uuid4().hex
    name = name or f"test-{mark[:8]}"
    with tempfile.TemporaryDirectory(prefix="scout-test-", dir=temporary_folder()) as folder:
        file = Path(folder) / "mission.xml"
        file.write_text(mission_text(mission, name, change or {}))
        runtime = folder if beside is None else beside.environment["XDG_RUNTIME_DIR"]
        environment = {**os.environ, "XDG_RUNTIME_DIR": runtime, MARK: mark}
        words = [str(BIN / "scout-backbone"), "up", str(file), "--headless", *options]
        with _started(words, environment) as launcher:
            running = RealMission(name, environment, launcher)
            reader = threading.Thread(target=_read, args=(running,), daemon=True)
            reader.start()
            try:
                running.wait_for_line("^all ready", READY_WITHIN_S)
                yield running
                if launcher.poll() is None:
                    launcher.terminate()  # as ``down`` would ask it, without a command that starts for it
                    if code := launcher.wait(DOWN_WITHIN_S):
                        raise AssertionError(f"'up' ended with {code} when it was asked to end")
                left = wait_gone(mark, GONE_WITHIN_S)
                if left:
                    raise AssertionError(f"left behind: {left}")
            except BaseException as error:
                error.add_note(running.story())
                raise
            finally:
                _end(launcher, mark)
                reader.join(5)


def mission_text(mission: Path | str, name: str, change: Mapping[str, str]) -> str:
    """Return the mission's text with this name and these texts replaced, for a file in any folder.

    Relative paths of rooms and floor plans become absolute; in a text they are relative to the working directory.
    """
    text = mission if is_text(mission) else Path(mission).read_text()
    text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{name}", text, count=1)
    for old, new in change.items():
        if old not in text:
            raise AssertionError(f"{old!r} is not in {mission}")
        text = text.replace(old, new)
    folder = Path.cwd() if is_text(mission) else Path(mission).resolve().parent
    begin = escape(f"{folder}/", QUOTES)
    return FILES.sub(lambda found: found[0] + begin, text)


def _started(words: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603  our own command line
        words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def _end(launcher: subprocess.Popen[str], mark: str) -> None:
    """Kill all processes that are left."""
    if launcher.poll() is None:
        launcher.kill()
    launcher.wait(10)
    left = wait_gone(mark, GONE_WITHIN_S)
    for process in left:
        with contextlib.suppress(psutil.Error):
            process.kill()
    psutil.wait_procs(left, timeout=GONE_WITHIN_S)


def wait_gone(mark: str, within_s: float) -> list[psutil.Process]:
    """Wait for the marked processes to end, at most for this time; return those that are left."""
    deadline = time.monotonic() + within_s
    while (left := marked(mark)) and time.monotonic() < deadline:
        psutil.wait_procs(left, timeout=0.1)
    return left


def _read(mission: RealMission) -> None:
    for line in mission.launcher.stdout or ():
        mission.lines.append(line.rstrip())
        mission.news.set()
    mission.is_over = True
    mission.news.set()


BringUp = Callable[..., AbstractContextManager[RealMission]]
"""``mission_up``."""
