"""The operating system's calls for one thread: niceness, and the processors it may run on.

On Linux both belong to the thread and not to its process, so a unit of a shared process has its own.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Collection

import msgspec

from backbone.errors import Refusal

LEAST_NICE, MOST_NICE = -20, 19  # setpriority(2)


class ThreadRefused(Refusal):
    """A thread cannot have the niceness or the processors that were asked for."""

    code = "module.thread"
    remedy = "Name processors that this host has, and a niceness of 0 or more, or give the user the right CAP_SYS_NICE."


class ThreadPlace(msgspec.Struct, frozen=True):
    """Where and how urgently a thread runs.

    Attributes:
        id: Number of the thread on its host.
        nice: -20, the most urgent, to 19.
        cpus: Processors it may run on.
    """

    id: int
    nice: int
    cpus: frozenset[int]

    def __str__(self) -> str:
        return f"thread {self.id}, nice {self.nice}, processors {_numbers(self.cpus)}"


def place_thread(nice: int, cpus: Collection[int]) -> ThreadPlace:
    """Place the calling thread, and return what the operating system then says of it.

    Args:
        nice: Added to the niceness of the thread; above 0: others come before it. Stays within -20 to 19.
        cpus: Processors it may run on; empty: all that it may run on already.

    Raises:
        ThreadRefused: This host lacks one of the processors, or the user may not raise the priority.
    """
    number = threading.get_native_id()
    there = os.sched_getaffinity(0)
    if missing := sorted(set(cpus) - there):
        raise ThreadRefused(f"this thread cannot run on processor {_numbers(missing)}, only on {_numbers(there)}")
    if nice:
        wanted = min(MOST_NICE, max(LEAST_NICE, os.getpriority(os.PRIO_PROCESS, number) + nice))
        try:
            os.setpriority(os.PRIO_PROCESS, number, wanted)
        except PermissionError:
            raise ThreadRefused(f"this user may not set the niceness of a thread to {wanted}") from None
    if cpus:
        os.sched_setaffinity(0, cpus)
    return ThreadPlace(number, os.getpriority(os.PRIO_PROCESS, number), frozenset(os.sched_getaffinity(0)))


def _numbers(cpus: Collection[int]) -> str:
    return ", ".join(map(str, sorted(cpus)))
