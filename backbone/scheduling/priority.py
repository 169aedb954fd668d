"""Order of priorities: numbers count among siblings of the behavior tree only.

``higher`` is a partial order. Two ARCs neither of which is higher are *equals*, but being equal is
not transitive, so there is no list of levels; ``by_precedence`` makes every order.

Source: IROS 2001 and RAM 2002, "behavior manager": priorities are compared among siblings; for
distant nodes walk up to the nearest ancestors with a common parent. Consoles are siblings of the
mission's root.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

Path = tuple[tuple[str, int], ...]
"""Nodes from the root to the owner, each with its number among its siblings."""

Level = tuple[Path, int]
"""Path of a parent, and the number its children of this level have: they are equals."""

T = TypeVar("T")

CONSOLE = "console "  # a legal node name holds no space: a console is never mistaken for a node of the tree


def higher(a: Path, b: Path) -> bool:
    """Return whether ``a`` is strictly higher than ``b``.

    Example:
        >>> scout1, scout2 = (("m", 0), ("watch", 5), ("left", 9)), (("m", 0), ("home", 6))
        >>> higher(scout2, scout1), higher(scout1, scout2)
        (True, False)
        >>> higher((("m", 0), ("watch", 5)), scout1)  # a parent's own request goes before its children's
        True
    """
    return rank(a, b) > 0


def rank(a: Path, b: Path) -> int:
    """Return 1 if ``a`` is strictly higher than ``b``, -1 if ``b`` is higher than ``a``, 0 if neither is."""
    for node_a, node_b in zip(a, b, strict=False):
        if node_a is not node_b and node_a[0] != node_b[0]:
            return (node_a[1] > node_b[1]) - (node_a[1] < node_b[1])
    return (len(a) < len(b)) - (len(a) > len(b))


def by_precedence(items: Sequence[T], path: Callable[[T], Path], key: Callable[[T], Any]) -> list[T]:
    """Return the items in order: each is the one of the smallest key among those without a higher remaining item.

    Sorting by (level, key) would be shorter and wrong: equality is not transitive, there are no levels.
    Each branch of the tree has an order of its own; equal siblings' orders are merged by their first items.

    Args:
        items: In any order.
        path: Of an item; a node has the same number in all of them.
        key: Of an item; of two with the same key the one that is first in ``items`` comes first.
    """
    keyed = sorted((key(item), place, path(item)) for place, item in enumerate(items))
    return [items[place] for _, place, _ in _in_order(keyed, 0)]


_Keyed = tuple[Any, int, Path]
"""Key of an item, its place among those given (no two are the same), and its path."""


def _in_order(keyed: list[_Keyed], depth: int) -> list[_Keyed]:
    """Return items of one branch, ``depth`` nodes below the root, in order; they are given sorted."""
    ordered: list[_Keyed] = []
    by_number: dict[int, list[_Keyed]] = {}
    for one in keyed:
        below = one[2]
        if len(below) == depth:
            ordered.append(one)
        else:
            by_number.setdefault(below[depth][1], []).append(one)
    for number in sorted(by_number, reverse=True):
        equals = by_number[number]
        if len(equals) == 1 or all(len(one[2]) == depth + 1 for one in equals):
            ordered += equals
            continue
        branches: dict[str, list[_Keyed]] = {}
        for one in equals:
            branches.setdefault(one[2][depth][0], []).append(one)
        orders = [_in_order(branch, depth + 1) for branch in branches.values()]
        # A sort would be wrong: the merge always takes the smaller of the first items, and keeps each branch's order.
        ordered += heapq.merge(*orders) if len(orders) > 1 else orders[0]
    return ordered
