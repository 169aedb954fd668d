"""Precedence: sorts ARCs by key, but no ARC before one that is higher (rule 2).

Source: RAM 2002, "behavior manager".
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from backbone.scheduling.priority import Path

T = TypeVar("T")


def by_precedence(items: Sequence[T], path: Callable[[T], Path], key: Callable[[T], Any]) -> list[T]:
    """Return the items in order: each has the smallest key among those without a higher remaining item.

    Sorting by (level, key) would be shorter and wrong, because equality is not transitive and levels do not exist.
    Each branch of the tree has an order of its own; the orders of equal siblings are merged by their first items.

    Args:
        items: The items, in any order.
        path: Returns the path of an item; a node has the same number in all paths.
        key: Returns the key of an item; of two items with equal keys the first in ``items`` comes first.
    """
    keyed = sorted((key(item), place, path(item)) for place, item in enumerate(items))
    return [items[place] for _, place, _ in _in_order(keyed, 0)]


_Keyed = tuple[Any, int, Path]
"""Key of an item, its place among the given items (unique), and its path."""


def _in_order(keyed: list[_Keyed], depth: int) -> list[_Keyed]:
    """Return items of one branch, ``depth`` nodes below the root, in order; ``keyed`` is sorted."""
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
