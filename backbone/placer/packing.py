"""Packing: which shared process of its host a component joins, where the mission file names none.

Rules:

* A component is packed if its order names no process and its class may share one. Processes of the mission file are not
  touched.
* The host is chosen first, by load. Then the component joins the pack of this host with the fewest members; of equal
  ones, the first.
* A component that goes to another host joins a pack there, so no pack holds a component on its host.
* The name of its process says that a component is packed, so a restarted placer knows it from the creators' lists.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

MOST_PACKS = 64  # chosen: more than any host's processors here; beyond, components may as well have their own processes
_PREFIX = "packed--"  # chosen: legal, and nobody would write it
WANTS_PACK = f"{_PREFIX}0"
"""Process of a packed component that has no host yet."""


def is_packed(process: str) -> bool:
    """Return whether a process is a pack, and not one of the mission file.

    Example:
        >>> is_packed("packed--1"), is_packed("hardware"), is_packed("")
        (True, False, False)
    """
    return process.startswith(_PREFIX)


def pack(processes: Iterable[str], count: int) -> str:
    """Return the pack that one more component joins.

    Args:
        processes: Of each component on the host.
        count: How many packs a host has, at least 1.

    Example:
        >>> pack(["packed--1", "packed--2", "packed--1", "hardware"], 2)
        'packed--2'
    """
    members = Counter(processes)
    return min((f"{_PREFIX}{number}" for number in range(1, count + 1)), key=lambda name: members[name])
