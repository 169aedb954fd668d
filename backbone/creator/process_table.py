"""The process table of Linux: descent of processes, their components, and processes that have ended.

Every component leads a session of its own, so its children stay recognizable by that session after the component's
death. A child that left the session by executing another program is recognized by a variable in its environment. A
zygote has a session of its own and the name of its parent. It ends its children by itself when the parent dies, and
needs time for that.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
import signal
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

MARK = "SCOUT_COMPONENT"
"""Environment variable with the pid of the component that started a process."""

_PR_SET_PDEATHSIG, _PR_SET_NAME, _PR_SET_CHILD_SUBREAPER = 1, 15, 36  # linux/prctl.h
_LONGEST_TITLE = 15  # linux/sched.h: TASK_COMM_LEN less its end mark
_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True, slots=True)
class Process:
    """One line of the table.

    Attributes:
        parent: Its parent's pid.
        session: Pid of the leader of its session; the leader may have ended.
        title: First 15 characters of its name.
        is_gone: True if it has ended and waits to be reaped.
    """

    parent: int
    session: int
    title: str
    is_gone: bool


Table = Mapping[int, Process]


def threads() -> int:
    """Return the number of threads of this process, threads of C libraries included."""
    return len(os.listdir("/proc/self/task"))


def read_table() -> dict[int, Process]:
    """Return all processes of this machine by pid."""
    table = {}
    for folder in os.listdir("/proc"):
        if folder.isdigit():
            with suppress(OSError):
                table[int(folder)] = read_line(Path(f"/proc/{folder}/stat").read_text())
    return table


def read_line(stat: str) -> Process:
    """Return the process of a line of ``/proc/<pid>/stat``.

    Example:
        >>> read_line("7 (a (b) c) S 1 7 7 0 -1")
        Process(parent=1, session=7, title='a (b) c', is_gone=False)
    """
    title, _, rest = stat.partition("(")[2].rpartition(")")
    state, parent, _group, session, *_ = rest.split()
    return Process(int(parent), int(session), title, state in "ZX")


def is_stopped(pid: int) -> bool:
    """Return whether a signal or a debugger has stopped the process."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] in "Tt"


def zygote_title(parent: int) -> str:
    """Return the title of the zygote that serves this process."""
    return f"zygote-{parent}"


def is_zygote(process: Process) -> bool:
    """Return whether the process is a zygote of this project."""
    return process.title.startswith(zygote_title(0)[:-1])


def descendants(table: Table, ancestor: int) -> set[int]:
    """Return the descendants that have not ended, without zygotes and their descendants."""
    children: dict[int, list[int]] = {}
    for pid, process in table.items():
        children.setdefault(process.parent, []).append(pid)
    found, to_see = set(), [ancestor]
    while to_see:
        for pid in children.get(to_see.pop(), []):
            if not is_zygote(table[pid]):
                to_see.append(pid)
                found.add(pid)
    return {pid for pid in found if not table[pid].is_gone}


def tree(table: Table, component: int) -> set[int]:
    """Return the processes of a living component: itself, its session, its descendants, no zygotes."""
    own = {component} & table.keys()
    session = {pid for pid, process in table.items() if process.session == component and not is_zygote(process)}
    return {pid for pid in own | session | descendants(table, component) if not table[pid].is_gone}


def remains(table: Table, component: int, adopter: int | None = None) -> set[int]:
    """Return the processes that an ended component left behind, except zygotes.

    Args:
        adopter: Process that inherited its children, if known; then fewer environments are read.
    """
    mark = f"{MARK}={component}".encode()
    left = {
        pid
        for pid, process in table.items()
        if process.session == component or (adopter in (None, process.parent) and mark in environment(pid))
    }
    return {pid for pid in left if not table[pid].is_gone and not is_zygote(table[pid])}


def zygotes_of(table: Table, parent: int) -> set[int]:
    """Return the zygotes that serve, or served, this process and have not ended."""
    title = zygote_title(parent)
    return {pid for pid, process in table.items() if process.title == title and not process.is_gone}


def environment(pid: int) -> list[bytes]:
    """Return the environment of the process at its start; empty if it has ended or belongs to another user."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    return []


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


# Settings of the calling process in the kernel.


def die_with_parent() -> None:
    """Ask the kernel to send SIGKILL to this process when the thread that forked it ends."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def adopt_orphans() -> None:
    """Make this process the parent of descendants whose own parent ends."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def set_title(title: str) -> None:
    """Set the name of this process in ``ps`` and ``top``, cut to 15 characters."""
    _prctl(_PR_SET_NAME, ctypes.create_string_buffer(title[:_LONGEST_TITLE].encode()))


def _prctl(option: int, value: object) -> None:
    argument = value if isinstance(value, ctypes.Array) else ctypes.c_ulong(value)  # type: ignore[arg-type]
    if _libc.prctl(option, argument, 0, 0, 0) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"prctl({option}): {os.strerror(number)}")
