"""Incarnation: one life of a component, told from every other life of the same name.

Host name and pid do not suffice. Two machines can be offered under one name, and in containers their processes have
the same pids.
"""

from __future__ import annotations

import os
from typing import NamedTuple

START_BYTES = 6  # chosen: two of a million lives are equal by a chance of 1 in 500; JavaScript keeps it exact


class Incarnation(NamedTuple):
    """One life of a component.

    Attributes:
        host: Host it runs on.
        pid: Pid of its process on that host.
        start: Random number of this life; 0: not known.
    """

    host: str
    pid: int
    start: int = 0


def random_start() -> int:
    """Return the number of a new life."""
    return int.from_bytes(os.urandom(START_BYTES))
