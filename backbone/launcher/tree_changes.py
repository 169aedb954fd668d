"""Tree changes: how an operator's change of the behavior tree changes each behavior. Pure.

The change itself is made in the text of the mission file (``tree_texts``). A behavior *stays* if it has the same parent
as before and its parent stays. The launcher sends it its new place, and it keeps its process. Every other running
behavior ends, and starts as the file now declares it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from backbone.mission.behavior_nodes import walk
from backbone.mission.behavior_orders import PLACE_PARAMETERS, behavior_order, node_of
from backbone.mission.model import MissionDescription
from backbone.placer.messages import Start

PRIORITY, RUN_TIMES = "priority", ("minimum_runtime_s", "maximum_runtime_s")


@dataclass(frozen=True, slots=True)
class ChangedMission:
    """A mission after a change of its tree.

    Attributes:
        mission: The mission that the changed file declares.
        text: Content of the changed file.
        anew: Names of behaviors that start again although the tree had such names, because their declarations are new.
        value: The value that was set, as a component gets it; None: the change sets no value.
    """

    mission: MissionDescription
    text: bytes
    anew: frozenset[str]
    value: bool | int | float | str | None


@dataclass(frozen=True, slots=True)
class NewPlace:
    """A behavior that stays and changes its place.

    Attributes:
        order: The order that starts it from now on.
        revised: The parameters of the order that say its place, and those that have changed.
        anew: Its children that end and start again.
        gone: Its former children.
    """

    order: Start
    revised: Mapping[str, Any]
    anew: tuple[str, ...]
    gone: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Consequences:
    """The actions that a changed tree requires.

    Attributes:
        ended: Roots that end.
        begun: Orders of the roots that start.
        told: Behaviors that stay and change their place or start children again, parents before their children.
        priorities: Name → priority, for each new or changed priority.
    """

    ended: list[str]
    begun: list[Start]
    told: list[NewPlace]
    priorities: dict[str, int]


@dataclass(frozen=True, slots=True)
class _Known:
    parent: str
    order: Start
    priority: int
    children: tuple[str, ...]


def consequences(old: MissionDescription, new: MissionDescription, anew: Collection[str]) -> Consequences:
    """Return the actions that lead from the old tree to the new one.

    Args:
        anew: Names of behaviors that start again, because their declarations are new.
    """
    before, after = _nodes(old), _nodes(new)
    stay: dict[str, bool] = {"": True}
    for name, node in after.items():
        is_same = name in before and before[name].parent == node.parent and name not in anew
        stay[name] = is_same and stay[node.parent]
    told = [
        NewPlace(
            node.order,
            _revised(before[name].order, node.order),
            tuple(child for child in node.children if child in anew and child in before[name].children),
            tuple(child for child in before[name].children if child not in node.children),
        )
        for name, node in after.items()
        if stay[name] and (node.order != before[name].order or any(child in anew for child in node.children))
    ]
    return Consequences(
        ended=[name for name, node in before.items() if not node.parent and not stay.get(name, False)],
        begun=[node.order for name, node in after.items() if not node.parent and not stay[name]],
        told=told,
        priorities={
            name: node.priority
            for name, node in after.items()
            if name not in before or before[name].priority != node.priority
        },
    )


def orders(mission: MissionDescription) -> dict[str, Start]:
    """Return the order that starts each behavior of the tree, by name."""
    return {name: node.order for name, node in _nodes(mission).items()}


def _revised(before: Start, after: Start) -> dict[str, Any]:
    """Return the parameters to revise; the others may be those of an exchanged class, which no tree knows."""
    had = before.parameters
    return {
        name: value
        for name, value in after.parameters.items()
        if name in PLACE_PARAMETERS or name not in had or had[name] != value
    }


def _nodes(mission: MissionDescription) -> dict[str, _Known]:
    found: dict[str, _Known] = {}
    for (*above, _own), node in walk(mission.behaviors, [(mission.name, mission.priority)]):
        parent = above[-1][0] if len(above) > 1 else ""
        order = behavior_order(node_of(node), above)
        found[node.name] = _Known(parent, order, node.priority, tuple(child.name for child in node.children))
    return found
