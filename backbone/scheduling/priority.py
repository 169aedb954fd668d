"""Order of priorities: numbers are compared only among siblings of the behavior tree.

``higher`` is a partial order. Two ARCs of which neither is higher are *equals*. Being equal is not transitive, so there
is no list of levels; ``precedence`` sorts ARCs.

Source: IROS 2001 and RAM 2002, "behavior manager": priorities are compared among siblings; for
distant nodes walk up to the nearest ancestors with a common parent. Consoles are siblings of the
mission's root.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

Path = tuple[tuple[str, int], ...]
"""Nodes from the root to the owner, each with its number among its siblings."""


@dataclass(slots=True, eq=False)
class Level:
    """Siblings with the same number, which are equals: one object for all of them.

    Attributes:
        depth: Length of their paths.
        ranks: Other level of the same depth → ``rank`` of any of these and any of those, as far as it is known.
    """

    depth: int
    ranks: dict[Level, int] = field(default_factory=dict)

    def __deepcopy__(self, _memo: object) -> Level:
        """Return the level itself: copies of the schedule share it, because the ranks never change."""
        return self


class Ranked(Protocol):
    """Has a place in the order of priorities.

    Attributes:
        path: Its path.
        level: The level of that path.
    """

    path: Path
    level: Level


CONSOLE = "console "  # a legal node name has no space, so a console is never mistaken for a node of the tree


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


def rank_of(a: Ranked, b: Ranked) -> int:
    """Return the ``rank`` of two paths; it is computed once for each pair of levels."""
    known = a.level.ranks.get(b.level)
    if known is None:
        known = rank(a.path, b.path)
        if a.level.depth == b.level.depth:  # else one of the two may be above the other
            a.level.ranks[b.level] = known
    return known
