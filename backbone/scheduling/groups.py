"""Groups: sets of ARCs that can affect each other.

A group is a connected component of active ARCs that share any RC. Sharable RCs count, too, because capacity couples
their users, even if not in pairs: of three ARCs of 0.4 any two fit, but not all three. Groups run in parallel and never
change each other's times.

Source: RAM 2002, "ARCs that ask for independent sets of RCs are put into different groups".
"""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import dataclass
from typing import Generic, TypeVar

A = TypeVar("A", bound=Hashable)

SPLIT_SHARE = 8  # chosen: a search through a big group costs each ARC that leaves it a few steps


@dataclass(slots=True, eq=False)
class Group(Generic[A]):
    """ARCs that share RCs; ``Groups`` splits a big group that has fallen apart only after a while.

    Attributes:
        left: Number of ARCs that left since the last check of its connectedness.
    """

    arcs: dict[A, None]
    left: int = 0


class Groups(Generic[A]):
    """The groups of the present ARCs.

    Attributes:
        of: Present ARC → its group.
        users: RC → the ARCs that use it, in the order of their arrival; empty if it was never used.

    Args:
        exact_up_to: A group of at most this size is always connected. A bigger one may consist of several groups until
            an eighth of its ARCs have left.
    """

    def __init__(self, exact_up_to: int) -> None:
        self._exact_up_to = exact_up_to
        self._uses: dict[A, Collection[str]] = {}
        self.users: dict[str, dict[A, None]] = {}
        self.of: dict[A, Group[A]] = {}

    def __contains__(self, arc: A) -> bool:
        return arc in self.of

    def add(self, arc: A, rcs: Collection[str]) -> None:
        """Add the ARC; it joins the groups of all ARCs that use its RCs."""
        self._uses[arc] = rcs
        joined = Group({arc: None})
        for rc in rcs:
            users = self.users.setdefault(rc, {})
            if users:
                joined = self._join(joined, self.of[next(iter(users))])
            users[arc] = None
        joined.arcs[arc] = None
        self.of[arc] = joined

    def remove(self, arc: A) -> None:
        """Remove the ARC; its group may fall apart."""
        for rc in self._uses.pop(arc):
            del self.users[rc][arc]
        group = self.of.pop(arc)
        del group.arcs[arc]
        group.left += 1
        if len(group.arcs) <= self._exact_up_to or group.left * SPLIT_SHARE > len(group.arcs):
            self._split(group)

    def _join(self, one: Group[A], other: Group[A]) -> Group[A]:
        if one is other:
            return one
        small, big = sorted((one, other), key=lambda group: len(group.arcs))
        big.arcs.update(small.arcs)
        for arc in small.arcs:
            self.of[arc] = big
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
                        new = [user for user in self.users[rc] if user in rest]
                        for user in new:
                            part.arcs[user] = rest.pop(user)
                        reached += new
            for arc in part.arcs:
                self.of[arc] = part
