"""Which ARC is higher, and in which order the waiting ARCs of a group are planned."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

Path = tuple[tuple[str, float], ...]
"""The nodes from the root to the owner, each with its number."""

T = TypeVar("T")


def higher(one: Path, other: Path) -> bool:
    """Return whether the first is higher: at the first difference the larger number, or the shorter path."""
    for (name, number), (other_name, other_number) in zip(one, other, strict=False):
        if name != other_name:
            return number > other_number
    return len(one) < len(other)


class NodeTree:
    """The behavior tree and the consoles beside it."""

    def __init__(self) -> None:
        self._parents: dict[str, str | None] = {}
        self._numbers: dict[str, float] = {}

    def put(self, name: str, parent: str | None, number: float) -> None:
        self._parents[name] = parent
        self._numbers[name] = number

    def knows(self, name: str) -> bool:
        return name in self._numbers

    def path(self, name: str) -> Path:
        """Return the way from the root to this node."""
        found: list[tuple[str, float]] = []
        at: str | None = name
        while at is not None and len(found) <= len(self._numbers):
            found.append((at, self._numbers[at]))
            at = self._parents[at]
        return tuple(reversed(found))

    def is_below(self, name: str, above: str) -> bool:
        return any(step == above for step, _ in self.path(name))


def console_node(owner: dict[str, Any]) -> str:
    return f"console {owner['id']}"


def ranked(arcs: Iterable[T], is_higher: Callable[[T, T], bool], stamp: Callable[[T], Any]) -> list[T]:
    """Return the ARCs in the order of the plan: again and again the oldest that no remaining one is above."""
    left = sorted(arcs, key=stamp)
    found: list[T] = []
    while left:
        first = next(one for one in left if not any(is_higher(other, one) for other in left if other is not one))
        left.remove(first)
        found.append(first)
    return found


def connected(arcs: Sequence[T], share: Callable[[T], Iterable[str]]) -> list[list[T]]:
    """Return the groups: ARCs that share an RC, directly or through others."""
    leader: dict[T, T] = {one: one for one in arcs}

    def top(one: T) -> T:
        while leader[one] is not one:
            one = leader[one]
        return one

    first: dict[str, T] = {}
    for one in arcs:
        for rc in share(one):
            leader[top(one)] = top(first.setdefault(rc, one))
    by_leader = sorted(((id(top(one)), place) for place, one in enumerate(arcs)))
    return [[arcs[place] for _, place in group] for _, group in itertools.groupby(by_leader, lambda pair: pair[0])]
