"""The new path of an element after another designer changed the text, so that each cursor stays on its element.

Pure: two drafts go in; a function from paths of the first to paths of the second comes out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from backbone.mission.edit import Element, Path
from ui_console.design.draft import Draft


def follower(before: Draft, after: Draft) -> Callable[[Path], Path]:
    """Return the function from an element's path in one draft to its path in another one.

    An element before or after all changes is found by its place in the text; another element by its text, if that is
    unique, or else by its number in its parent. A removed element is mapped to its parent.

    Args:
        before: The draft of the given paths.
        after: The draft of the returned paths.
    """
    old, new = before.text, after.text
    prefix = _alike(old, new)
    most = min(len(old), len(new)) - prefix
    suffix = _alike(old[len(old) - most :][::-1], new[len(new) - most :][::-1])
    once = Counter(old[node.span.begin : node.span.content] for node in before.mission)
    by_begin = {node.span.begin: node.path for node in after.mission}
    by_head: dict[bytes, list[Path]] = {}
    for node in after.mission:
        by_head.setdefault(new[node.span.begin : node.span.content], []).append(node.path)

    def same(node: Element) -> Path | None:
        if node.span.content <= prefix:
            return by_begin.get(node.span.begin)
        if node.span.begin >= len(old) - suffix:
            return by_begin.get(node.span.begin + len(new) - len(old))
        head = old[node.span.begin : node.span.content]
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
    """Return the number of equal bytes at the beginning."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low
