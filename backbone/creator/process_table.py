"""The process table of Linux: descent of processes, their components, and processes that have ended.

Every component leads a process group of its own, so its children stay recognizable by that group after the component's
death. A child that left the group by executing another program is recognized by a variable in its environment. A zygote
has a session of its own and the name of its parent. It ends its children by itself when the parent dies, and needs time
for that.

All components of a zygote share its session, because Linux may give each session the same part of the processor
(autogroup, sched(7)). If each component had a session, forty starting components would delay a command typed at a
terminal, and their niceness would have no effect on each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from backbone.operating_system import processes

MARK = "SCOUT_COMPONENT"
"""Environment variable with the pid of the component that started a process."""


@dataclass(frozen=True, slots=True)
class Process:
    """One line of the table.

    Attributes:
        parent: Its parent's pid.
        group: Pid of the leader of its process group; the leader may have ended.
        title: First 15 characters of its name.
        is_gone: True if it has ended and waits to be reaped.
    """

    parent: int
    group: int
    title: str
    is_gone: bool


Table = Mapping[int, Process]


def read_table() -> dict[int, Process]:
    """Return all processes that this one may signal, by pid."""
    return {pid: read_line(line) for pid, line in processes.table_lines().items()}


def read_line(stat: str) -> Process:
    """Return the process of a line of ``/proc/<pid>/stat``.

    Example:
        >>> read_line("7 (a (b) c) S 1 7 7 0 -1")
        Process(parent=1, group=7, title='a (b) c', is_gone=False)
    """
    title, _, rest = stat.partition("(")[2].rpartition(")")
    state, parent, group, *_ = rest.split()
    return Process(int(parent), int(group), title, state in "ZX")


def is_stopped(pid: int) -> bool:
    """Return whether a signal or a debugger has stopped the process."""
    try:
        stat = processes.table_line(pid)
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
    """Return the processes of a living component: itself, its process group, its descendants, no zygotes."""
    own = {component} & table.keys()
    group = {pid for pid, process in table.items() if process.group == component and not is_zygote(process)}
    return {pid for pid in own | group | descendants(table, component) if not table[pid].is_gone}


def remains(table: Table, component: int, adopter: int | None = None) -> set[int]:
    """Return the processes that an ended component left behind, except zygotes.

    Args:
        adopter: Process that inherited its children, if known; then fewer environments are read.
    """
    mark = f"{MARK}={component}".encode()
    left = {
        pid
        for pid, process in table.items()
        if process.group == component or (adopter in (None, process.parent) and mark in processes.environment(pid))
    }
    return {pid for pid in left if not table[pid].is_gone and not is_zygote(table[pid])}


def zygotes_of(table: Table, parent: int) -> set[int]:
    """Return the zygotes that serve, or served, this process and have not ended."""
    title = zygote_title(parent)
    return {pid for pid, process in table.items() if process.title == title and not process.is_gone}
