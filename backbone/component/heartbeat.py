"""Heartbeat of a process: the time stamp of a small file, which its event loop increments and its creator reads.

The heartbeat does not use the bus, so a lost hub never makes a process seem hung. A time stamp needs no disk space: on
a full disk only the line with the present step is missing. If a ready process could not create its file, it never
counts as hung.

Before the creator replaces a process with a blocked event loop, it orders the process by ``WRITE_STACKS`` to write the
stacks of its threads to its log. That needs neither the event loop nor the interpreter's lock.

Prior art: systemd's watchdog notifications. Here the supervisor reads at its own pace.
"""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from backbone.atomic_file import freed_later
from backbone.bus.interface import Clock
from backbone.operating_system.processes import first_bytes, processor_times_s

log = logging.getLogger(__name__)

BEAT_EVERY_S = 1 / 3  # chosen: a hung process is seen within 1 s, at three wake-ups of the event loop a second
WRITE_STACKS = signal.SIGURG  # chosen: programs that a component began ignore it, as does any program by default
DOING_BYTES = 160  # chosen: a line for people
_FOLDER = "heartbeat"
_ONE_BEAT_NS = 1_000_000_000  # chosen: every file system keeps whole seconds
_LATEST_NS = 1_000_000_000 * _ONE_BEAT_NS  # 2001: the stamp of a file before its first beat is later


@dataclass(frozen=True, slots=True)
class Vitals:
    """One reading of a process; every value only grows.

    Attributes:
        beats: Heartbeats of its event loop; 0 before the first.
        ran_s: Processor seconds of its main thread.
        queued_s: Seconds that its main thread waited for a processor.
        doing: Its present step, for people.
    """

    beats: int
    ran_s: float = 0.0
    queued_s: float = 0.0
    doing: str = ""


class Heartbeat:
    """The writing side, inside the process.

    Args:
        run_directory: Folder of the mission's files on this host; empty: no file is written.
        doing: Returns the present step, one line.
    """

    def __init__(self, run_directory: str, doing: Callable[[], str] = str) -> None:
        self._doing, self._beats, self._file, self._said = doing, 0, -1, b""
        if not run_directory:
            return
        path = heartbeat_path(run_directory, os.getpid())
        try:
            path.parent.mkdir(mode=0o700, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
        except OSError as error:
            log.warning("cannot write the heartbeat: %s", error)

    async def keep(self, clock: Clock) -> None:
        """Write a beat every ``BEAT_EVERY_S`` until cancelled."""
        while self._file >= 0:
            self._write()
            await clock.sleep_s(BEAT_EVERY_S * clock.rate)

    def close(self) -> None:
        """Stop writing and close the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _write(self) -> None:
        self._beats += 1
        doing = self._doing().encode(errors="replace")[:DOING_BYTES].ljust(DOING_BYTES)
        if doing != self._said:
            with suppress(OSError):  # a full disk
                os.pwrite(self._file, doing, 0)
                self._said = doing
        stamp_ns = self._beats * _ONE_BEAT_NS
        os.utime(self._file, ns=(stamp_ns, stamp_ns))


def heartbeat_path(run_directory: str, pid: int) -> Path:
    """Return the path of the heartbeat of this pid."""
    return Path(run_directory) / _FOLDER / str(pid)


def read_vitals(run_directory: str, pid: int) -> Vitals | None:
    """Read the vitals of a process; None if the process has ended."""
    times_s = processor_times_s(pid)
    if times_s is None:
        return None
    beats, doing = 0, b""
    if run_directory:
        path = f"{run_directory}/{_FOLDER}/{pid}"
        with suppress(OSError):
            stamp_ns = os.stat(path).st_mtime_ns
            beats = 0 if stamp_ns > _LATEST_NS else stamp_ns // _ONE_BEAT_NS
            doing = first_bytes(path, DOING_BYTES)
    return Vitals(beats, *times_s, doing.decode(errors="replace").strip())


def forget_heartbeat(run_directory: str, pid: int) -> None:
    """Remove the heartbeat of a process that has ended, if it wrote one."""
    path = heartbeat_path(run_directory, pid)
    with suppress(OSError), freed_later(path):
        path.unlink()
