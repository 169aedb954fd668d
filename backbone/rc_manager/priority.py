"""Who goes before whom: numbers count among siblings of the behavior tree only.

``higher`` is a partial order. Two ARCs neither of which is higher are *equals*, but being equal is
not transitive, so there is no list of levels; everything that needs an order uses ``by_precedence``.

Source: IROS 2001 and RAM 2002, "behavior manager": priorities are compared among siblings; for
distant nodes walk up to the nearest ancestors with a common parent. Consoles are siblings of the
mission's root.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from backbone.rc_manager.messages import PathNode

Path = tuple[tuple[str, int], ...]
"""Nodes from the root to the owner, each with its number among its siblings."""

T = TypeVar("T")

CONSOLE = "console "  # a legal node name holds no space: a console is never mistaken for a node of the tree


def higher(a: Path, b: Path) -> bool:
    """Say whether ``a`` goes strictly before ``b``.

    Example:
        >>> scout1, scout2 = (("m", 0), ("watch", 5), ("left", 9)), (("m", 0), ("home", 6))
        >>> higher(scout2, scout1), higher(scout1, scout2)
        (True, False)
        >>> higher((("m", 0), ("watch", 5)), scout1)  # a parent's own request goes before its children's
        True
    """
    return rank(a, b) > 0


def rank(a: Path, b: Path) -> int:
    """Return 1 if ``a`` goes strictly before ``b``, -1 if ``b`` goes before ``a``, 0 if neither does."""
    for (name_a, number_a), (name_b, number_b) in zip(a, b, strict=False):
        if name_a != name_b:
            return (number_a > number_b) - (number_a < number_b)
    return (len(a) < len(b)) - (len(a) > len(b))


def by_precedence(items: Sequence[T], path: Callable[[T], Path], key: Callable[[T], Any]) -> list[T]:
    """Return the items in order: again and again the one of the smallest key that no remaining one is higher than.

    Sorting by (level, key) would be shorter and wrong: equality is not transitive, there are no levels.
    Each branch of the tree has an order of its own; equal siblings' orders are merged by what each has first.

    Args:
        items: In any order.
        path: Of an item; a node has the same number in all of them.
        key: Of an item; of two with the same key the one that is first in ``items`` comes first.
    """
    root = _Branch()
    for place, item in enumerate(items):
        branch = root
        for node in path(item):
            branch = branch.children.get(node) or branch.children.setdefault(node, _Branch())
        branch.own.append((key(item), place))
    return [items[place] for _, place in root.in_order()]


class _Branch:
    """A node of the tree that is being ordered: keys and places of its own items, and its children."""

    __slots__ = ("children", "own")

    def __init__(self) -> None:
        self.own: list[tuple[Any, int]] = []
        self.children: dict[tuple[str, int], _Branch] = {}

    def in_order(self) -> list[tuple[Any, int]]:
        ordered = sorted(self.own)
        by_number: dict[int, list[_Branch]] = {}
        for (_, number), child in self.children.items():
            by_number.setdefault(number, []).append(child)
        for number in sorted(by_number, reverse=True):
            equals = by_number[number]
            leaves = sorted(one for child in equals if not child.children for one in child.own)
            orders = [leaves, *(child.in_order() for child in equals if child.children)]
            # Not sorted each: merging takes the smaller of the first ones again and again, which is what is wanted.
            ordered += heapq.merge(*orders) if len(orders) > 1 else leaves
        return ordered


class PriorityTree:
    """The numbers of all nodes and consoles that ever asked.

    A number set by an operator holds until the operator sets another; a request's own numbers hold
    for nodes nobody set.
    """

    def __init__(self, mission: str, priority: int) -> None:
        self._mission = mission
        self._numbers: dict[tuple[str, ...], int] = {(mission,): priority}
        self._set: dict[str, int] = {}
        self._raised: dict[tuple[str, ...], int] = {}

    def place(self, nodes: Iterable[PathNode], *, console: bool) -> tuple[tuple[str, ...], bool]:
        """Take note of the nodes on this way.

        Returns:
            Their names, root first, and whether a node known before has another number now.
        """
        way = list(nodes)
        if console:
            way = [PathNode(CONSOLE + node.name, node.priority) for node in way]
        elif not way or way[0].name != self._mission:
            way.insert(0, PathNode(self._mission, self._numbers[self._mission,]))
        names: tuple[str, ...] = ()
        renumbered = False
        for node in way:
            names = (*names, node.name)
            number = self._set.get(node.name.removeprefix(CONSOLE), node.priority)
            renumbered |= self._numbers.setdefault(names, number) != number
            self._numbers[names] = number
        return names, renumbered

    def path(self, names: tuple[str, ...]) -> Path:
        """Return the way with its present numbers."""
        return tuple(
            (name, self._numbers[way] + self._raised.get(way, 0))
            for name, way in ((name, names[: depth + 1]) for depth, name in enumerate(names))
        )

    def age(self, levels: Iterable[tuple[tuple[str, ...], int]]) -> bool:
        """Raise nodes whose ARCs wait long by some levels, others by none any more; return whether that changed any.

        A node rises with all above it, or it would rise among its siblings only. The mission's own node
        does not: a console is not outwaited. Neither do consoles.

        Args:
            levels: Ways of the nodes and by how much they rise; of several for one node the largest counts.
        """
        raised: dict[tuple[str, ...], int] = {}
        for names, by in levels:
            for depth in range(2, len(names) + 1):
                way = names[:depth]
                raised[way] = max(by, raised.get(way, 0))
        changed = raised != self._raised
        self._raised = raised
        return changed

    def change(self, node: str, priority: int) -> None:
        """Give the node, or the console, of this name another number from now on."""
        self._set[node] = priority
        for names in self._numbers:
            if names[-1].removeprefix(CONSOLE) == node:
                self._numbers[names] = priority
