"""Where an element stands after somebody else changed the text, so that a cursor stays on what its owner chose.

Pure: two drafts in, a way from the one's places to the other's out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from backbone.mission.edit import Node, Path
from ui_console.design.draft import Draft


def follower(before: Draft, after: Draft) -> Callable[[Path], Path]:
    """Return what leads from an element of one draft to the same one in another.

    What stands before or behind all that was changed is found by its place in the text, else what is written like
    nothing else by its tag, else by its number in the element that it stood in; what is gone leads to what held it.

    Args:
        before: The draft in which elements were chosen.
        after: The draft in which they are looked for.
    """
    old, new = before.text, after.text
    prefix = _alike(old, new)
    most = min(len(old), len(new)) - prefix
    suffix = _alike(old[len(old) - most :][::-1], new[len(new) - most :][::-1])
    once = Counter(old[node.begin : node.content] for node in before.mission)
    by_begin = {node.begin: node.path for node in after.mission}
    by_head: dict[bytes, list[Path]] = {}
    for node in after.mission:
        by_head.setdefault(new[node.begin : node.content], []).append(node.path)

    def same(node: Node) -> Path | None:
        if node.content <= prefix:
            return by_begin.get(node.begin)
        if node.begin >= len(old) - suffix:
            return by_begin.get(node.begin + len(new) - len(old))
        head = old[node.begin : node.content]
        found = by_head.get(head, [])
        return found[0] if len(found) == once[head] == 1 else None

    def lead(path: Path) -> Path:
        node = before.mission.at(path)
        found = same(node)
        if found is not None or not path:
            return found or ()
        above = after.mission.at(lead(path[:-1]))
        if path[-1] < len(above.children) and above.children[path[-1]].tag == node.tag:
            return above.children[path[-1]].path
        return above.path

    return lead


def _alike(one: bytes, other: bytes) -> int:
    """Return how many bytes are the same from the beginning on."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low
