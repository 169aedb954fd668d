"""Processes of this machine as the kernel shows them: lines of its table, environments, processor time, signals."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Collection, Iterable
from contextlib import suppress
from pathlib import Path

_NS = 1e-9


def threads() -> int:
    """Return the number of threads of this process, threads of C libraries included."""
    return len(os.listdir("/proc/self/task"))


def table_lines() -> dict[int, str]:
    """Return pid → its line, as ``/proc/<pid>/stat`` has it, of all processes of this machine."""
    lines = {}
    for folder in os.listdir("/proc"):
        if folder.isdigit():
            with suppress(OSError):
                lines[int(folder)] = table_line(int(folder))
    return lines


def table_line(pid: int) -> str:
    """Return the line of a process.

    Raises:
        OSError: It has ended.
    """
    return Path(f"/proc/{pid}/stat").read_text()


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
        ran_ns, queued_ns, *_ = Path(f"/proc/{pid}/schedstat").read_bytes().split()
        return int(ran_ns) * _NS, int(queued_ns) * _NS
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        return 0.0, 0.0


def send(pids: Iterable[int], number: signal.Signals) -> None:
    """Send the signal to each process; skip processes that have ended."""
    for pid in pids:
        with suppress(ProcessLookupError):
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
