"""The behavior tree: nodes with priorities.

Rules of this file: no bus, no clock. A priority counts among siblings only; the RC manager compares two nodes by their
paths from the root.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec

from backbone.mission.behavior_orders import PathStep, behavior_order
from backbone.placer.messages import Start


class ArcNeed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ARC that a behavior claims.

    Attributes:
        kind: Component type of the ARC.
        minimum_runtime_s: Shortest useful time, seconds, above 0.
        wish: Role → name wanted.
        features: Role → features wanted.
        maximum_runtime_s: End of extensions, seconds; 0: the minimum.
        period_s: Interval between radio packets, seconds.
        packet_time_s: Air time of one packet, seconds.
    """

    kind: str
    minimum_runtime_s: float
    wish: dict[str, str] = {}
    features: dict[str, list[str]] = {}
    maximum_runtime_s: float = 0.0
    period_s: float = 0.05
    packet_time_s: float = 0.002


class BehaviorNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A node of the tree, with the nodes below it.

    Attributes:
        name: Name of the node and of its component.
        priority: Among its siblings; larger is higher.
        arc: The ARC that it claims, if any.
        process: Name of its shared process; empty: it has its own process.
    """

    type: str
    name: str
    priority: int
    parameters: dict[str, Any] = {}
    arc: ArcNeed | None = None
    children: list[BehaviorNode] = []
    process: str = ""

    def order(self, parent_path: Sequence[PathStep]) -> Start:
        """Return the order that starts this node under a parent with this path."""
        plain: dict[str, object] = msgspec.to_builtins(self)
        return behavior_order(plain, parent_path)


def walk(nodes: Sequence[BehaviorNode], path: Sequence[PathStep] = ()) -> Iterator[tuple[list[PathStep], BehaviorNode]]:
    """Yield every node with its path, parents before their children, in the given order."""
    for node in nodes:
        own = [*path, (node.name, node.priority)]
        yield own, node
        yield from walk(node.children, own)


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
        >>> print(draw([BehaviorNode("surveillance", "watch", 5, children=[leaf])], {"watch1": "running"}))
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
