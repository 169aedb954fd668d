"""The behavior tree as text, for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from backbone.mission.behavior_nodes import BehaviorNode


def draw(
    nodes: Sequence[BehaviorNode], remarks: Mapping[str, str] | None = None, *, in_file_order: bool = False
) -> str:
    """Return the tree as text, one line a node, siblings of higher priority first.

    Args:
        nodes: The roots.
        remarks: Name of a node → remark after the node.
        in_file_order: Siblings keep the order of the mission file; priorities do not matter.

    Example:
        >>> leaf = BehaviorNode("watch_for_motion", "watch1", 3)
        >>> print(draw([BehaviorNode("surveillance", "watch", 5, children=(leaf,))], {"watch1": "running"}))
        watch (surveillance, priority 5)
        └─ watch1 (watch_for_motion, priority 3): running
    """
    return "\n".join(_lines(nodes, remarks or {}, in_file_order, ""))


def _lines(
    nodes: Sequence[BehaviorNode], remarks: Mapping[str, str], in_file_order: bool, margin: str, root: bool = True
) -> Iterator[str]:
    ordered = nodes if in_file_order else sorted(nodes, key=lambda node: -node.priority)
    for node in ordered:
        last = node is ordered[-1]
        branch, below = ("", "") if root else ("└─ ", "   ") if last else ("├─ ", "│  ")
        remark = f": {remarks[node.name]}" if remarks.get(node.name) else ""
        yield f"{margin}{branch}{node.name} ({node.type}, priority {node.priority}){remark}"
        yield from _lines(node.children, remarks, in_file_order, margin + below, root=False)
