"""System calls for one thread: niceness and allowed processors.

On Linux both belong to the thread, not to its process, so each unit of a shared process has its own values.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Collection

import msgspec

from backbone.errors import Refusal

LEAST_NICE, MOST_NICE = -20, 19  # setpriority(2)


class ThreadRefused(Refusal):
    """A thread cannot have the requested niceness or processors."""

    code = "module.thread"
    remedy = "Name processors that this host has, and a niceness of 0 or more, or give the user the right CAP_SYS_NICE."


class ThreadPlace(msgspec.Struct, frozen=True):
    """Processors and priority of a thread.

    Attributes:
        id: Number of the thread on its host.
        nice: -20, the most urgent, to 19.
        cpus: Allowed processors.
    """

    id: int
    nice: int
    cpus: frozenset[int]

    def __str__(self) -> str:
        return f"thread {self.id}, nice {self.nice}, processors {_numbers(self.cpus)}"


def place_thread(nice: int, cpus: Collection[int]) -> ThreadPlace:
    """Set niceness and processors of the calling thread; return the values that the operating system then reports.

    Args:
        nice: Added to the niceness of the thread; above 0: other threads have priority. The sum is clipped to -20 to
            19.
        cpus: Processors on which it may run; empty: unchanged.

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
