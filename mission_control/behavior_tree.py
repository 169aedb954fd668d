"""The behavior tree as text, for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from backbone.mission.behavior_nodes import BehaviorNode
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.children import Children
from mission_control.messages import BehaviorState


def state_of(behavior: BehaviorOfParts, rules: Children, *, is_last: bool) -> BehaviorState:
    """Return a behavior's progress, with its branch of the tree as its rules see it."""
    children, (name, priority) = tuple(behavior.child_nodes.values()), behavior.path[-1]
    node = BehaviorNode(behavior.launch.type, name, priority, children=children)
    status = f"last branch; {behavior.status}" if is_last else str(behavior.status)
    about_it = f"{status}; {rules.sentence}" if rules.sentence else status
    tree = draw([node], rules.remarks() | {name: about_it}, in_file_order=rules.in_file_order)
    return BehaviorState(name, behavior.status, behavior.payload, dict(behavior.rcs), behavior.suspended_because, tree)


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
