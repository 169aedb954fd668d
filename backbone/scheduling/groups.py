"""Groups: sets of ARCs that can affect each other.

A group is a connected component of active ARCs that share any RC, sharable ones too: capacity
couples them, and not pairwise (of three ARCs of 0.4 any two fit, three do not). Groups run in
parallel and never change each other's times.

``groups`` computes them; ``Groups`` keeps them up to date while ARCs come and go.

Source: RAM 2002, "ARCs that ask for independent sets of RCs are put into different groups".
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from typing import Generic, TypeVar

A = TypeVar("A", bound=Hashable)

SPLIT_SHARE = 8  # chosen: a search through a big group costs each ARC that leaves it a few steps


def groups(uses: Mapping[str, Collection[str]]) -> list[list[str]]:
    """Return the groups of these ARCs.

    Args:
        uses: ARC → RCs it needs.

    Returns:
        Every ARC once; groups and their members in the order of ``uses``.

    Example:
        >>> groups({"left": {"v1", "s1"}, "arm": {"a"}, "right": {"v1", "s2"}})
        [['left', 'right'], ['arm']]
    """
    users: dict[str, list[str]] = {}
    for arc, rcs in uses.items():
        for rc in rcs:
            users.setdefault(rc, []).append(arc)
    group_of: dict[str, int] = {}
    number = 0
    for arc in uses:
        if arc in group_of:
            continue
        reached = [arc]
        group_of[arc] = number
        while reached:
            for rc in uses[reached.pop()]:
                for neighbor in users.pop(rc, ()):
                    if neighbor not in group_of:
                        group_of[neighbor] = number
                        reached.append(neighbor)
        number += 1
    found: list[list[str]] = [[] for _ in range(number)]
    for arc in uses:
        found[group_of[arc]].append(arc)
    return found


class Group(Generic[A]):
    """ARCs that share RCs; a big group may have fallen apart for a while before ``Groups`` splits it."""

    __slots__ = ("_left", "arcs")

    def __init__(self, arcs: dict[A, None]) -> None:
        self.arcs = arcs
        self._left = 0

    def __len__(self) -> int:
        return len(self.arcs)

    def leave(self, arc: A) -> int:
        """Remove the ARC; return how many have left since the last check that the group is one."""
        del self.arcs[arc]
        self._left += 1
        return self._left


class Groups(Generic[A]):
    """The groups of the present ARCs.

    Args:
        exact_up_to: Groups of at most this size are always exactly one group; bigger ones may be
            several taken together until an eighth of their ARCs have left.
    """

    def __init__(self, exact_up_to: int) -> None:
        self._exact_up_to = exact_up_to
        self._uses: dict[A, Collection[str]] = {}
        self._users: dict[str, dict[A, None]] = {}
        self._of: dict[A, Group[A]] = {}

    def __contains__(self, arc: A) -> bool:
        return arc in self._of

    def of(self, arc: A) -> Group[A]:
        """Return the group of a present ARC."""
        return self._of[arc]

    def users(self, rc: str) -> Collection[A]:
        """Return the ARCs that use the RC, in the order of their arrival."""
        return self._users.get(rc, {})

    def all(self) -> list[Group[A]]:
        """Return all groups, in the order of their first ARCs' arrivals."""
        return list(dict.fromkeys(self._of.values()))

    def add(self, arc: A, rcs: Collection[str]) -> None:
        """Add the ARC; it joins the groups of all ARCs that use its RCs."""
        self._uses[arc] = rcs
        joined = Group({arc: None})
        for rc in rcs:
            users = self._users.setdefault(rc, {})
            if users:
                joined = self._join(joined, self._of[next(iter(users))])
            users[arc] = None
        joined.arcs[arc] = None
        self._of[arc] = joined

    def remove(self, arc: A) -> None:
        """Remove the ARC; its group may fall apart."""
        for rc in self._uses.pop(arc):
            del self._users[rc][arc]
        group = self._of.pop(arc)
        left = group.leave(arc)
        if len(group) <= self._exact_up_to or left * SPLIT_SHARE > len(group):
            self._split(group)

    def _join(self, one: Group[A], other: Group[A]) -> Group[A]:
        if one is other:
            return one
        small, big = sorted((one, other), key=len)
        big.arcs.update(small.arcs)
        for arc in small.arcs:
            self._of[arc] = big
        return big

    def _split(self, group: Group[A]) -> None:
        rest = dict(group.arcs)
        while rest:
            reached = [next(iter(rest))]
            part = Group({reached[0]: rest.pop(reached[0])})
            looked: set[str] = set()
            while reached:
                for rc in self._uses[reached.pop()]:
                    if rc not in looked:
                        looked.add(rc)
                        new = [user for user in self._users[rc] if user in rest]
                        for user in new:
                            part.arcs[user] = rest.pop(user)
                        reached += new
            for arc in part.arcs:
                self._of[arc] = part
