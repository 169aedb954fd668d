"""Groups: which ARCs can have anything to do with each other.

A group is a connected component of active ARCs that share any RC, sharable ones too: capacity
couples them, and not pairwise (of three ARCs of 0.4 any two fit, three do not). Groups run in
parallel and never change each other's times.

Source: RAM 2002, "ARCs that ask for independent sets of RCs are put into different groups".
"""

from __future__ import annotations

from collections.abc import Collection, Mapping


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
