"""Locks on open files, which the system releases when their process ends for any reason."""

from __future__ import annotations

import fcntl


def lock_alone_nowait(descriptor: int) -> None:
    """Lock the file for this process alone until it is closed.

    Raises:
        BlockingIOError: Another process has locked it.
    """
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def lock_together(descriptor: int) -> None:
    """Lock the file together with other processes until it is closed; wait while a process has it alone."""
    fcntl.flock(descriptor, fcntl.LOCK_SH)
