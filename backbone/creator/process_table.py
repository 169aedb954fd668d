"""What Linux knows of processes: who descends from whom, who belongs to which component, who is gone.

Every component leads a session of its own, so whatever it starts stays recognizable by that session
after the component's death. What left the session by executing another program is recognized by a
variable in its environment. A zygote is in a session of its own and named after its parent: it ends
its children by itself when the parent dies, and must be given the time to do so.
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
"""Environment variable with the pid of the component a process was started by."""

_PR_SET_PDEATHSIG, _PR_SET_NAME, _PR_SET_CHILD_SUBREAPER = 1, 15, 36  # linux/prctl.h
_LONGEST_TITLE = 15  # linux/sched.h: TASK_COMM_LEN less its end mark
_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True, slots=True)
class Process:
    """One line of the table.

    Attributes:
        parent: Its parent's pid.
        session: Pid of its session's leader, who may be gone.
        title: First 15 characters of its name.
        is_gone: It has ended and only waits to be reaped.
    """

    parent: int
    session: int
    title: str
    is_gone: bool


Table = Mapping[int, Process]


def threads() -> int:
    """Return how many threads this process has, other languages' included."""
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
    """Return what a line of ``/proc/<pid>/stat`` says.

    Example:
        >>> read_line("7 (a (b) c) S 1 7 7 0 -1")
        Process(parent=1, session=7, title='a (b) c', is_gone=False)
    """
    title, _, rest = stat.partition("(")[2].rpartition(")")
    state, parent, _group, session, *_ = rest.split()
    return Process(int(parent), int(session), title, state in "ZX")


def is_stopped(pid: int) -> bool:
    """Say whether the process was stopped by a signal or a debugger."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] in "Tt"


def zygote_title(parent: int) -> str:
    """Return the title of the zygote that serves this process."""
    return f"zygote-{parent}"


def is_zygote(process: Process) -> bool:
    """Say whether it is a zygote of ours."""
    return process.title.startswith(zygote_title(0)[:-1])


def descendants(table: Table, ancestor: int) -> set[int]:
    """Return who descends from the process and has not ended, but no zygote and nothing below one."""
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
    """Return what is there of a component that still lives: itself, its session, its descendants, no zygotes."""
    own = {component} & table.keys()
    session = {pid for pid, process in table.items() if process.session == component and not is_zygote(process)}
    return {pid for pid in own | session | descendants(table, component) if not table[pid].is_gone}


def remains(table: Table, component: int, adopter: int | None = None) -> set[int]:
    """Return what a component that has ended left behind, except zygotes.

    Args:
        adopter: Who inherited its children, if that is known: fewer environments have to be read then.
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
    """Return the environment the process's program was started with; empty if it is gone or another user's."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    return []


def send(pids: Iterable[int], number: signal.Signals) -> None:
    """Send the signal to each; those that are gone meanwhile are passed over."""
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


# What a process says of itself to the kernel.


def die_with_parent() -> None:
    """Have the kernel send SIGKILL to this process when the thread that forked it ends."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def adopt_orphans() -> None:
    """Make this process the parent of descendants whose own parent ends."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def set_title(title: str) -> None:
    """Show this process under that name, cut to 15 characters, in ``ps`` and ``top``."""
    _prctl(_PR_SET_NAME, ctypes.create_string_buffer(title[:_LONGEST_TITLE].encode()))


def _prctl(option: int, value: object) -> None:
    argument = value if isinstance(value, ctypes.Array) else ctypes.c_ulong(value)  # type: ignore[arg-type]
    if _libc.prctl(option, argument, 0, 0, 0) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"prctl({option}): {os.strerror(number)}")
