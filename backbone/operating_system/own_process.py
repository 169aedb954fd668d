"""Settings of the calling process in the kernel: its title, its parent's death, orphans, its limit of open files."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
from contextlib import suppress

_PR_SET_PDEATHSIG, _PR_SET_NAME, _PR_SET_CHILD_SUBREAPER = 1, 15, 36  # linux/prctl.h
_LONGEST_TITLE = 15  # linux/sched.h: TASK_COMM_LEN less its end mark
_BEHIND = 10  # chosen: half of the range
_libc = ctypes.CDLL(None, use_errno=True)


def die_with_parent() -> None:
    """Ask the kernel to send SIGKILL to this process when the thread that forked it ends."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def adopt_orphans() -> None:
    """Make this process the parent of descendants whose own parent ends."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def set_title(title: str) -> None:
    """Set the name of this process in ``ps`` and ``top``, cut to 15 characters."""
    _prctl(_PR_SET_NAME, ctypes.create_string_buffer(title[:_LONGEST_TITLE].encode()))


def allow_many_files() -> None:
    """Raise the limit of open files of this process and its later children to what the system allows them.

    The usual limit of 1024 is meant for programs that call ``select``; a hub has four files or more for each process.
    """
    _now, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(OSError, ValueError):  # the limit of the whole system was lowered meanwhile
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


def most_files() -> int:
    """Return how many files the system lets this process open at once, see ``allow_many_files``."""
    _now, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    return sys.maxsize if most == resource.RLIM_INFINITY else most


def go_behind_others() -> None:
    """Lower this process's priority below other processes of this machine, if the system has priorities.

    Processes that record, count or show call this, so that processes that decide and command run first.
    """
    with suppress(OSError):
        os.nice(_BEHIND)


def _prctl(option: int, value: object) -> None:
    argument = value if isinstance(value, ctypes.Array) else ctypes.c_ulong(value)  # type: ignore[arg-type]
    if _libc.prctl(option, argument, 0, 0, 0) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"prctl({option}): {os.strerror(number)}")
