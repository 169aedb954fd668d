"""Processes of this machine as the kernel shows them: lines of its table, environments, processor time, signals."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Collection, Iterable
from contextlib import suppress
from pathlib import Path

TABLE, MOUNTS_TABLE = "/proc", "mount -t proc proc /proc"
"""Folder in which the kernel shows its processes, and the command that mounts it."""
_NS = 1e-9
_LINE_BYTES = 4096  # the kernel's lines are shorter


def first_bytes(path: str, most: int) -> bytes:
    """Return the first bytes of a small file, for half of the processor time of a file object.

    Raises:
        OSError: The file cannot be read.
    """
    file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        return os.read(file, most)
    finally:
        os.close(file)


def is_table_readable() -> bool:
    """Return whether the kernel shows its processes and the load of its processors, as ``/proc`` does if mounted."""
    return os.access("/proc/self/stat", os.R_OK) and os.access("/proc/stat", os.R_OK)


def threads() -> int:
    """Return the number of threads of this process, threads of C libraries included."""
    return len(os.listdir("/proc/self/task"))


def open_files() -> int:
    """Return the number of open files of this process.

    Raises:
        OSError: It has as many as the system allows.
    """
    return len(os.listdir("/proc/self/fd"))


def table_lines() -> dict[int, str]:
    """Return pid → its line, as ``/proc/<pid>/stat`` has it, of all processes that this one may signal.

    Processes of other accounts may have any name, so their lines are left out.
    """
    lines = {}
    for pid in map(int, filter(str.isdigit, os.listdir("/proc"))):
        with suppress(OSError):
            os.kill(pid, 0)
            lines[pid] = table_line(pid)
    return lines


def table_line(pid: int) -> str:
    """Return the line of a process.

    Raises:
        OSError: It has ended.
    """
    return first_bytes(f"/proc/{pid}/stat", _LINE_BYTES).decode(errors="replace")


def exists(pid: int) -> bool:
    """Return whether there is a process of this pid; one that waits to be reaped counts."""
    return Path(f"/proc/{pid}").exists()


def environment(pid: int) -> list[bytes]:
    """Return the environment of the process at its start; empty if it has ended or belongs to another user."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    return []


def processor_times_s(pid: int) -> tuple[float, float] | None:
    """Return how long the main thread has run and waited for a processor; None: the process has ended.

    Both are 0 where the kernel does not count them.
    """
    try:
        ran_ns, queued_ns, *_ = first_bytes(f"/proc/{pid}/schedstat", _LINE_BYTES).split()
        return int(ran_ns) * _NS, int(queued_ns) * _NS
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        return 0.0, 0.0


def send(pids: Iterable[int], number: signal.Signals) -> None:
    """Send the signal to each process; skip processes that have ended, or have become another account's."""
    for pid in pids:
        with suppress(ProcessLookupError, PermissionError):
            os.kill(pid, number)


async def wait_gone(pids: Collection[int]) -> None:
    """Return when each of these processes, children or not, has ended."""
    loop = asyncio.get_running_loop()
    for pid in pids:
        try:
            handle = os.pidfd_open(pid)
        except ProcessLookupError:
            continue
        gone = asyncio.Event()
        loop.add_reader(handle, gone.set)
        try:
            await gone.wait()
        finally:
            loop.remove_reader(handle)
            os.close(handle)
