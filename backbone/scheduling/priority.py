"""Order of priorities: numbers are compared only among siblings of the behavior tree.

``higher`` is a partial order. Two ARCs of which neither is higher are *equals*. Being equal is not transitive, so there
is no list of levels; ``precedence`` sorts ARCs.

Source: IROS 2001 and RAM 2002, "behavior manager": priorities are compared among siblings; for
distant nodes walk up to the nearest ancestors with a common parent. Consoles are siblings of the
mission's root.
"""

from __future__ import annotations

Path = tuple[tuple[str, int], ...]
"""Nodes from the root to the owner, each with its number among its siblings."""

Level = tuple[Path, int]
"""Path of a parent, and a number of its children; the children with this number are equals."""

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
