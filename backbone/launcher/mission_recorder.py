"""The recorder of a mission, or of one of its hosts, that was started with ``--record``: a process of its own.

It begins before the first component, which waits for it, and ends after the last. If it ends early, the recording
continues in a further file. If its file cannot grow, it is absent with the reason, on a full disc until there is room.
If it cannot begin, it is tried again. If it hangs, it is absent until it responds again.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import os
import shutil
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from backbone.bus.interface import Clock
from backbone.component.messages import Absence
from backbone.errors import Refusal
from backbone.launcher.endings import ExitCode
from backbone.launcher.recorder_signs import watch
from backbone.mission.model import MissionDescription
from backbone.ranges import LONGEST_LINE
from backbone.waiting import end_tasks

BEGUN_WITHIN_S = 20.0  # chosen: as long as a component has to become ready; a machine that swaps needs longer
ENDED_WITHIN_S = 10.0  # chosen: writing the index of an hour takes less than a second
AGAIN_AFTER_S = 1.0  # chosen: the cause of its end may be over by then; seconds of the machine
AGAIN_AT_LEAST_EACH_S = 60.0  # chosen: a process that begins for nothing each minute takes no time from others
ROOM_EACH_S = 5.0  # chosen: a person who frees disc space waits no longer
ROOM_BYTES = 200 * 1000 * 1000  # chosen: twice ``recorder.LEAST_FREE_BYTES``, else it would soon end again
NAME = "recorder"
BEGUN = "records to"
"""What a recorder prints when it listens."""
READ_BYTES = 65_536  # chosen: as much as a pipe holds on Linux

log = logging.getLogger(__name__)


class RecorderFailed(Refusal):
    """The mission cannot be recorded to this file."""

    code = "run.recorder"
    remedy = "Name a new file in a folder where this user may write, or leave out --record."


def require_new(path: Path) -> None:
    """Return if a recording can begin in this file, else raise.

    Raises:
        RecorderFailed: The file exists, or cannot be made.
    """
    if os.path.exists(path):
        raise RecorderFailed(f"{path} exists")
    require_writable(path)


def require_writable(path: Path) -> None:
    """Return if a recording can begin in the first unused file of this series, else raise.

    Raises:
        RecorderFailed: It is a folder or a device, there is no such folder, or no such file can be made in it.
    """
    folder = path.absolute().parent
    if os.path.exists(path) and not os.path.isfile(path):
        raise RecorderFailed(f"{path} is no regular file")
    if not os.path.isdir(folder):
        raise RecorderFailed(f"there is no folder {folder}")
    free = first_free(path)
    try:
        free.open("xb").close()  # permission bits alone do not decide: /proc takes no new file, also of root
        free.unlink()
    except OSError as error:
        raise RecorderFailed(f"{free} cannot be written: {error.strerror or error}") from error


def first_free(path: Path) -> Path:
    """Return the first unused name in a series of recordings: ``night.mcap``, ``night-2.mcap`` and so on."""
    numbered = (path.with_stem(f"{path.stem}-{number}") for number in itertools.count(2))
    return next(each for each in itertools.chain((path,), numbered) if not os.path.exists(each))


def recorder_of_mission(
    description: MissionDescription, text: bytes, path: Path, clock: Clock, run_directory: str
) -> MissionRecorder:
    """Return the recorder on the launcher's host; of all pictures, it records only those of this host.

    Args:
        text: The mission file.
    """
    paths = [kind.class_path for kind in description.types]
    paths += [one["class_path"] for unit in description.units for one in unit.parameters["modules"]]
    modules = sorted({path.partition(":")[0] for path in paths})
    facts = json.dumps({"mission_xml": text.decode(), "modules": modules}).encode()
    return MissionRecorder(description.name, path, clock, ["--described", "--host-folder", run_directory], facts)


class MissionRecorder:
    """Keeps one recorder running.

    Args:
        path: File of the recording; the first unused name of its series is used.
        options: Further options of the command ``record``.
        facts: The facts of the mission, which the recorder reads from standard input.
        name: Name of the recorder in the mission, for people.

    Attributes:
        on_changed: Called with one line for people when the recorder was lost, or records again.
    """

    def __init__(
        self, mission: str, path: Path, clock: Clock, options: Sequence[str], facts: bytes = b"", name: str = NAME
    ) -> None:
        self.on_changed: Callable[[str], None] = lambda _line: None
        self._name = name
        self._mission, self._path, self._clock = mission, path.absolute(), clock
        self._options, self._facts = options, facts
        self._process: Process | None = None
        self._reading: asyncio.Task[str] | None = None
        self._watching: asyncio.Task[None] | None = None
        self._absence: Absence | None = self._not_begun()

    def absence(self) -> Absence | None:
        """Return the recorder as absent while it does not run or respond."""
        return self._absence

    async def begin(self, *, is_awaited: bool = True) -> None:
        """Start the recorder; return when it listens.

        Args:
            is_awaited: True: wait for it as long as it runs; after ``BEGUN_WITHIN_S``, its absence has the remedy.
                False: end it then.

        Raises:
            RecorderFailed: The recorder did not begin; the detail has the reason.
        """
        self._absence = self._absence or self._not_begun()
        self._reading = None
        try:
            self._process = process = await self._started()
        except OSError as error:
            raise RecorderFailed(f"the recorder did not begin: {error}") from error
        assert process.stderr is not None  # noqa: S101  a pipe
        lines = _PrintedLines(process.stderr)
        telling = asyncio.create_task(self._tell_facts(process, lines), name="what the recorder says first")
        try:
            await asyncio.wait({telling}, timeout=BEGUN_WITHIN_S)
            if is_awaited and not telling.done():
                self._is_late(process)
                await asyncio.wait({telling})
            said = telling.result() if telling.done() else f"it did not begin within {BEGUN_WITHIN_S:g} s"
        finally:
            await end_tasks(telling)
        self._reading = asyncio.create_task(_last_line(process, lines), name="what the recorder says")
        if BEGUN not in said:
            await self.end()
            raise RecorderFailed(f"the recorder did not begin: {said or 'it ended without a word'}")
        assert process.stdout is not None  # noqa: S101  a pipe
        self._watching = asyncio.create_task(watch(process.stdout, self._silent), name="whether the recorder responds")
        self._absence = None

    async def begin_or_be_lost(self) -> None:
        """Start the recorder; return when it listens, or when it did not begin. ``keep`` then starts it again."""
        try:
            await self.begin(is_awaited=False)
        except RecorderFailed as error:
            self._lost(error.detail, "it is tried again", error.remedy)

    async def keep(self) -> None:
        """Start the recorder again whenever it does not run, until cancelled."""
        while True:
            if self._process is None:
                await self._begin_again()
            assert self._process is not None  # noqa: S101  it was begun
            process, last = self._process, await self._ended()
            if process.returncode != ExitCode.REFUSED:
                self._lost(last, "the recording goes on in a further file")
            elif not self._has_room():
                self._lost(last, "the recording goes on in a further file when there is room", "Free disc space.")
                while not self._has_room():
                    await self._clock.sleep_s(ROOM_EACH_S * self._clock.rate)
            else:
                self._lost(last, "", "Bring the mission up with another file.")
                return
            await self._begin_again()

    async def _begin_again(self) -> None:
        rest_s = AGAIN_AFTER_S
        while True:
            await self._clock.sleep_s(rest_s * self._clock.rate)
            try:
                await self.begin(is_awaited=False)
            except RecorderFailed as error:
                rest_s = min(2.0 * rest_s, AGAIN_AT_LEAST_EACH_S)
                self._lost(error.detail, f"it is tried again in {rest_s:g} s", error.remedy)
            else:
                self.on_changed("the recording goes on")
                return

    def _has_room(self) -> bool:
        try:
            return shutil.disk_usage(self._path.parent).free >= ROOM_BYTES
        except OSError:  # the folder is gone, maybe with a disc that comes back
            return False

    async def end(self) -> None:
        """End the recorder after its file is complete. Idempotent."""
        process = self._process
        if process is None:
            return
        with suppress(ProcessLookupError):
            process.terminate()
            process.send_signal(signal.SIGCONT)  # a paused recorder can then complete its file, too
        try:
            async with asyncio.timeout(ENDED_WITHIN_S):
                await self._ended()
        except TimeoutError:
            log.warning("the recorder did not end; its file can be recovered")
            process.kill()
            await self._ended()
        self._process = None

    async def _started(self) -> Process:
        path = first_free(self._path)
        command = ["-P", "-m", "backbone.command_line.cli", "record", "--to", str(path), "--mission", self._mission]
        return await asyncio.create_subprocess_exec(
            *(sys.executable, *command, *self._options),
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            start_new_session=True,  # Ctrl-C at the terminal ends the launcher, which ends the recorder last
        )

    async def _tell_facts(self, process: Process, lines: _PrintedLines) -> str:
        """Write the facts of the mission to the recorder; return its line that it records, or else the last line.

        Anything may come before it, because a module of the mission may print when it is imported. Without facts the
        recorder's input stays open. When this process ends, that input closes, and the recorder ends.
        """
        assert process.stdin is not None  # noqa: S101  a pipe
        if self._facts:
            with suppress(ConnectionError):
                process.stdin.write(self._facts)
                await process.stdin.drain()
            process.stdin.close()
        said = ""
        while BEGUN not in said and (line := await lines.next()):
            said = _text(line) or said
        return said

    async def _ended(self) -> str:
        """Return the last line that it said, or its exit code, when it has ended."""
        assert self._process is not None  # noqa: S101  it was begun
        if self._reading is None:  # its begin was broken off
            return f"exit code {await self._process.wait()}"
        last = await asyncio.shield(self._reading)
        return last or f"exit code {await self._process.wait()}"

    def _not_begun(self) -> Absence:
        return Absence(self._name, self._clock.now_s(), "it does not listen yet", "components here wait for it")

    def _is_late(self, process: Process) -> None:
        cause, doing = f"it has not begun within {BEGUN_WITHIN_S:g} s", "components here wait for it"
        remedy = f"Wait, if this machine is busy, or 'kill -9 {process.pid}'; then the mission does not come up."
        since_s = self._absence.since_s if self._absence is not None else self._clock.now_s()
        self._absence = Absence(self._name, since_s, cause, doing, remedy)
        self.on_changed(f"waits for its recorder: {cause}")

    def _silent(self, is_silent: bool) -> None:
        if self._process is None or self._process.returncode is not None:
            return
        if is_silent:
            pid = self._process.pid
            remedy = f"Wake it by 'kill -CONT {pid}', or 'kill -9 {pid}': then the recording goes on in a further file."
            doing = "its recording stands still, and messages wait for it as far as there is room"
            self._absence = Absence(self._name, self._clock.now_s(), "it does not respond", doing, remedy)
            self.on_changed(f"its recorder does not respond: {doing}")
        else:
            self._absence = None
            self.on_changed("its recorder responds again")

    def _lost(self, cause: str, doing: str, remedy: str = "") -> None:
        is_known = self._absence is not None and self._absence.cause == cause
        self._absence = Absence(self._name, self._clock.now_s(), cause, doing, remedy)
        if not is_known:
            self.on_changed(f"lost its recorder: {cause}{f'; {doing}' if doing else ''}")


def absences_of(recorder: MissionRecorder | None) -> list[Absence]:
    """Return the recorder while it is absent; None: nothing is to be recorded."""
    lost = recorder.absence() if recorder is not None else None
    return [] if lost is None else [lost]


class _PrintedLines:
    """The lines that a process prints; of a long one, such as a progress bar, only the end."""

    def __init__(self, printed: asyncio.StreamReader) -> None:
        self._printed, self._came = printed, b""

    async def next(self) -> bytes:
        """Return the next line with its end; empty: there is no more."""
        while b"\n" not in self._came and (some := await self._printed.read(READ_BYTES)):
            self._came = self._came[-LONGEST_LINE:] + some
        line, end, self._came = self._came.partition(b"\n")
        return line[-LONGEST_LINE:] + end


async def _last_line(process: Process, lines: _PrintedLines) -> str:
    """Wait for the end of the process; return the last line that it printed."""
    last = ""
    while line := await lines.next():
        last = _text(line)
    await process.wait()
    return last


def _text(line: bytes) -> str:
    text = line.decode(errors="replace").strip()
    log.info("recorder: %s", text)
    return text
