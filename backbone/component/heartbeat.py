"""Heartbeat of a process: a counter in a small file that its event loop writes and its creator reads.

No message crosses the bus, so a lost hub never makes a process look hung, and reading costs the process nothing.
A process without a file, because the disk is full, is judged by its use of the processor alone.

Prior art: systemd's watchdog notifications. Here the supervisor reads at its own pace.
"""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from backbone.bus.interface import Clock

log = logging.getLogger(__name__)

BEAT_EVERY_S = 0.25  # chosen: a hung process is seen within 1 s, at four wake-ups of the event loop a second
DOING_BYTES = 160  # chosen: a line for people
_RECORD = struct.Struct(f"<Q{DOING_BYTES}s")
_NS = 1e-9


@dataclass(frozen=True, slots=True)
class Vitals:
    """What one look at a process shows; every value only grows.

    Attributes:
        beats: Heartbeats of its event loop; 0 before the first.
        ran_s: Processor seconds its main thread used.
        queued_s: Seconds its main thread was ready to run and waited for a processor.
        doing: What the process says it is doing, for people.
    """

    beats: int
    ran_s: float = 0.0
    queued_s: float = 0.0
    doing: str = ""


class Heartbeat:
    """The writing side, inside the process.

    Args:
        run_directory: Folder of the mission's files on this host; empty: nothing is written.
        doing: Returns what the process is doing, one line.
    """

    def __init__(self, run_directory: str, doing: Callable[[], str] = str) -> None:
        self._doing, self._beats, self._file = doing, 0, -1
        if not run_directory:
            return
        path = heartbeat_path(run_directory, os.getpid())
        try:
            path.parent.mkdir(mode=0o700, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
        except OSError as error:
            log.warning("no heartbeat can be written: %s", error)

    async def keep(self, clock: Clock) -> None:
        """Write a beat every ``BEAT_EVERY_S`` until cancelled."""
        while self._file >= 0:
            self._write()
            await clock.sleep_s(BEAT_EVERY_S * clock.rate)

    def close(self) -> None:
        """Write nothing any more."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _write(self) -> None:
        self._beats += 1
        doing = self._doing().encode(errors="replace")[:DOING_BYTES]
        try:
            os.pwrite(self._file, _RECORD.pack(self._beats, doing), 0)
        except OSError as error:
            log.warning("heartbeats end: %s", error)
            self.close()


def heartbeat_path(run_directory: str, pid: int) -> Path:
    """Return where the process of this pid writes its heartbeat."""
    return Path(run_directory) / "heartbeat" / str(pid)


def read_vitals(run_directory: str, pid: int) -> Vitals | None:
    """Return what the system shows of a process; None if the process has ended."""
    try:
        ran_ns, queued_ns, *_ = Path(f"/proc/{pid}/schedstat").read_bytes().split()
    except FileNotFoundError:
        return None
    except (OSError, ValueError):  # a kernel without these counters
        ran_ns, queued_ns = b"0", b"0"
    beats, doing = 0, b""
    if run_directory:
        try:
            record = heartbeat_path(run_directory, pid).read_bytes()
        except OSError:
            record = b""
        if len(record) == _RECORD.size:
            beats, doing = _RECORD.unpack(record)
    return Vitals(beats, int(ran_ns) * _NS, int(queued_ns) * _NS, doing.rstrip(b"\0").decode(errors="replace"))


def forget_heartbeat(run_directory: str, pid: int) -> None:
    """Remove the heartbeat of a process that has ended; right also if it never wrote one."""
    with suppress(OSError):
        heartbeat_path(run_directory, pid).unlink()
