"""Converts the behavior tree of a mission file to the orders that start its roots.

A behavior starts with its own parameters from the file, and with those of the tree: ``path`` (from the mission's root
to this node), ``arc`` (its claim), ``children`` (whole nodes, which the behavior starts itself, by the same rule). The
root of the last branch also gets ``is_last``. A behavior that a console ordered also gets ``keeper`` (the console).
A behavior applies the rule to its children, so nothing here imports the mission's model at run time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from backbone.errors import Refusal
from backbone.mission.behavior_nodes import BehaviorNode, PathStep
from backbone.placer.messages import Start

if TYPE_CHECKING:
    from backbone.mission.model import MissionDescription

Node = Mapping[str, Any]
"""A node of the behavior tree as plain data, with the nodes below it."""
PLACE_PARAMETERS = ("path", "arc", "children")
"""Parameters that a change of the running tree may set."""
TREE_PARAMETERS = (*PLACE_PARAMETERS, "is_last", "keeper")
"""Parameters that the starter of a behavior sets, not the mission file."""


class ReservedParameter(Refusal):
    """A behavior's own parameter has a name that belongs to the tree."""

    code = "mission.reserved_parameter"
    remedy = f"Give the parameter another name; {', '.join(TREE_PARAMETERS)} are set when a behavior is started."


def behavior_orders(description: MissionDescription) -> list[Start]:
    """Return the orders that start the roots of the tree, in the mission file's order.

    Raises:
        ReservedParameter: A behavior, at any depth, has a parameter with a reserved name.
    """
    top = [(description.name, description.priority)]
    return [behavior_order(_node(behavior), top) for behavior in description.behaviors]


def last_order(description: MissionDescription) -> Start | None:
    """Return the order that starts the last branch; None: the mission has none.

    Raises:
        ReservedParameter: A behavior of the branch has a parameter with a reserved name.
    """
    if description.last is None:
        return None
    order = behavior_order(_node(description.last.behavior), [(description.name, description.priority)])
    return msgspec.structs.replace(order, parameters={**order.parameters, "is_last": True})


def behavior_order(node: Node, parent_path: Sequence[PathStep]) -> Start:
    """Return the order that starts one node of the tree.

    Args:
        node: ``type``, ``name``, ``priority``, ``parameters``, ``arc``, ``children``, ``process``.
        parent_path: Names and priorities from the mission's root to the parent.

    Raises:
        ReservedParameter: One of its own parameters has a reserved name.

    Example:
        >>> node = {"type": "wander", "name": "w", "priority": 3, "parameters": {"speed_m_s": 0.2}}
        >>> behavior_order(node, [("mission", 10)]).parameters["path"]
        [['mission', 10], ['w', 3]]
    """
    own = dict(node.get("parameters", {}))
    if taken := [name for name in TREE_PARAMETERS if name in own]:
        raise ReservedParameter(f"{node['name']}: parameter {taken[0]!r}", behavior=node["name"], parameter=taken[0])
    path = [[name, priority] for name, priority in (*parent_path, (node["name"], node["priority"]))]
    tree = {"path": path, "arc": node.get("arc"), "children": list(node.get("children", ()))}
    return Start(node["type"], node["name"], {**own, **tree}, process=node.get("process", ""))


def node_of(behavior: BehaviorNode) -> Node:
    """Return the node of the tree as plain data, as a message carries it."""
    node: Node = msgspec.msgpack.decode(msgspec.msgpack.encode(behavior))
    return node


def _node(behavior: BehaviorNode) -> Node:
    node = node_of(behavior)
    _refuse_reserved(node)
    return node


def _refuse_reserved(node: Node) -> None:
    for child in node["children"]:
        behavior_order(child, ())
        _refuse_reserved(child)
