"""The behavior tree: nodes with priorities. A priority counts among siblings only; paths from the root are compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

PathStep = tuple[str, int]
"""Name and priority of a node."""


class ArcNeed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ARC that a behavior claims.

    Attributes:
        kind: Component type of the ARC.
        minimum_runtime_s: Shortest time in which the behavior can do something useful, seconds, above 0.
        wish: Role → name wanted.
        features: Role → features wanted.
        maximum_runtime_s: Longest slice with all extensions, seconds; 0: the minimum.
        period_s: Interval between its radio packets, seconds.
        packet_time_s: Time one of its radio packets is on the air, seconds.
    """

    kind: str
    minimum_runtime_s: float
    wish: dict[str, str] = {}
    features: dict[str, tuple[str, ...]] = {}
    maximum_runtime_s: float = 0.0
    period_s: float = 0.05
    packet_time_s: float = 0.002


class BehaviorNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A node of the tree, with the nodes below it.

    Attributes:
        type: Its component type.
        name: Name of the node and of its component, unique in the mission.
        priority: Among its siblings; larger is higher.
        parameters: Values for the class's parameters.
        arc: The ARC that it claims, if any.
        children: Nodes that it starts.
        process: Name of the process it shares with others; empty: a process of its own.
    """

    type: str
    name: str
    priority: int
    parameters: dict[str, Any] = {}
    arc: ArcNeed | None = None
    children: tuple[BehaviorNode, ...] = ()
    process: str = ""


def walk(nodes: Sequence[BehaviorNode], path: Sequence[PathStep] = ()) -> Iterator[tuple[list[PathStep], BehaviorNode]]:
    """Yield every node with its path, parents before their children, in the given order."""
    for node in nodes:
        own = [*path, (node.name, node.priority)]
        yield own, node
        yield from walk(node.children, own)
