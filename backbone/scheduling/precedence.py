"""Precedence: every order of ARCs, the smallest key first but none before one that is higher (rule 2).

Source: RAM 2002, "behavior manager".
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from backbone.scheduling.priority import Path

T = TypeVar("T")


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
