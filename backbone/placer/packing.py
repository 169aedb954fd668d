"""Packing: the choice of a component's process on its host, so that a host has few processes and none is too full.

Rules:

* The host is chosen first, by load. Then the component joins a process there; the same state leads to the same choice.
* If the number of packs is set, a component whose order names no process joins the pack with the fewest members; among
  equal packs, the first.
* If it is not set, components of one type share processes as soon as there are many: the first ones have their own, and
  each further process holds at most as many. So ARCs, which command, never wait for behaviors, which search pictures.
* If a process of the mission file is full, further members join its next part.
* Members never change their process while they run.
* The name of its process shows that a component is packed, so a restarted placer knows it from the creators' lists.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable
from itertools import chain, count

from backbone.creator.messages import Spawn

MOST_PACKS = 64  # chosen: more than any host's processors here; with more packs, own processes would be as good
MEMBERS_MOST = 64  # chosen: twice as many as the missions here have; a hang or kill of the process ends at most these
_PREFIX = "packed--"  # chosen: legal, and unlike any name in a mission file
_LONGEST = 56  # chosen: the longest legal name less the number of a part
WANTS_PACK = f"{_PREFIX}0"
"""Process of a packed component that has no host yet."""


def is_packed(process: str) -> bool:
    """Return whether a process is a pack, and not one of the mission file.

    Example:
        >>> is_packed("packed--1"), is_packed("hardware"), is_packed("")
        (True, False, False)
    """
    return process.startswith(_PREFIX)


def whole(process: str) -> str:
    """Return the process that this one is a part of; itself if it is whole.

    Example:
        >>> whole("hardware--2"), whole("hardware")
        ('hardware', 'hardware')
    """
    return re.sub(r"--\d+$", "", process)


def joined(spawn: Spawn, there: Collection[Spawn], packs: int) -> str:
    """Return the process that a component joins on its host; empty: it has its own.

    Args:
        spawn: The order to start the component.
        there: The orders of the other components on the host.
        packs: How many packs a host has, at least 1.
    """
    if spawn.alike_most > 1:
        alike = [one.process for one in there if one.type == spawn.type and one.alike_most > 1]
        return "" if alike.count("") < spawn.alike_most else _with_room(alike, spawn.type, spawn.alike_most)
    processes = [one.process for one in there]
    if is_packed(spawn.process):
        return pack(processes, packs)
    return spawn.process and part(processes, spawn.process)


def pack(processes: Iterable[str], count: int) -> str:
    """Return the pack that one more component joins.

    Args:
        processes: Process of each component on the host.
        count: How many packs a host has, at least 1.

    Example:
        >>> pack(["packed--1", "packed--2", "packed--1", "hardware"], 2)
        'packed--2'
    """
    members = Counter(processes)
    return min((f"{_PREFIX}{number}" for number in range(1, count + 1)), key=lambda name: members[name])


def part(processes: Iterable[str], process: str) -> str:
    """Return the first part of a process that has room for one more member.

    Args:
        processes: Process of each component on the host.

    Example:
        >>> part(["hardware"] * 64, "hardware"), part(["hardware"] * 63, "hardware")
        ('hardware--2', 'hardware')
    """
    members = Counter(processes)
    parts = chain([process], (f"{process[:_LONGEST]}--{number}" for number in count(2)))
    return next(name for name in parts if members[name] < MEMBERS_MOST)


def _with_room(processes: Iterable[str], name: str, most: int) -> str:
    """Return the process of this name and the lowest number that has room for one more member."""
    members = Counter(processes)
    numbered = (f"{name[:_LONGEST]}--{number}" for number in count(1))
    return next(process for process in numbered if members[process] < most)
