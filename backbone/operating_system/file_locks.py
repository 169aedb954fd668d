"""Locks on open files, which the system lets go when their process ends, however it ends."""

from __future__ import annotations

import fcntl


def lock_alone_nowait(descriptor: int) -> None:
    """Have the file alone until it is closed.

    Raises:
        BlockingIOError: Another process has it.
    """
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def lock_together(descriptor: int) -> None:
    """Have the file together with others until it is closed; wait while another has it alone."""
    fcntl.flock(descriptor, fcntl.LOCK_SH)
