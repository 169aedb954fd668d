"""Determines the behavior that carries out an order: kind of ARC, localizer, path and parameters. Pure."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from backbone.component.messages import ComponentState
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.errors import Refusal
from backbone.naming import Subsystem, component_of, did_you_mean
from backbone.placer.messages import Start
from backbone.scheduling.views import RequestView
from resource_pool.arc_client import ROBOT
from ui_console.model.arc_abilities import arc_abilities
from ui_console.model.arc_kinds import arc_kind
from ui_console.model.orders import Order, OrderKind
from ui_console.model.profile import Sight

LOCALIZER, SIMULATED_WORLD = "localizer", "simulated_world"
FARTHEST_M = 1000.0  # chosen: the largest room
EQUAL = 1  # chosen: all orders of a console have equal priority
NEEDS_PLACES = frozenset({OrderKind.GO_TO, OrderKind.RETURN, OrderKind.FOLLOW})


class NoLocalizer(Refusal):
    """The mission has no component that knows the places of robots."""

    code = "order.no_localizer"
    remedy = "Start a component of type localizer, as the mission file names it; or drive by the stick."


class CannotOrder(Refusal):
    """The robot, or the mission, cannot carry out this order."""

    code = "order.impossible"
    remedy = "Give another order, or drive by the stick."


@dataclass(frozen=True, slots=True)
class FoundLocalizer:
    """A component that localizes robots.

    Attributes:
        words: Source of the positions, for people.
    """

    address: str
    words: str


def localizer_of(components: Sequence[ComponentState]) -> FoundLocalizer:
    """Return the mission's localizer, else its simulated world.

    Args:
        components: Running components of the mission.

    Raises:
        NoLocalizer: The mission has neither.
    """
    for kind in (LOCALIZER, SIMULATED_WORLD):
        found = sorted(one.address for one in components if one.type == kind)
        if found:
            name = component_of(found[0])
            simulated = f"positions from {name}, the simulator itself: no real room has it"
            return FoundLocalizer(found[0], simulated if kind == SIMULATED_WORLD else f"positions from {name}")
    raise NoLocalizer("no component of this mission tells where robots are")


def kind_for(order: Order, types: Sequence[ComponentType], resources: Collection[Resource]) -> str:
    """Return the kind of ARC that the order's behavior claims: for watching, one with pictures; else one that drives.

    Raises:
        CannotOrder: No robot is named, its hardware does not suffice, the place is not valid, or the mission has no
            such behavior.
        NoArcKind: No robot has this name.
    """
    if not order.robot:
        raise CannotOrder("no robot is meant", remedy="Name the robot, or take one first.")
    names = [one.name for one in types]
    if order.kind not in names:
        raise CannotOrder(f"this mission has no behavior {order.kind}{did_you_mean(order.kind, names)}")
    if not max(abs(order.x_m), abs(order.y_m)) <= FARTHEST_M:
        place = f"{order.x_m:g}, {order.y_m:g}"
        raise CannotOrder(f"{place} is no place in a room", remedy=f"Give meters, at most {FARTHEST_M:g}.")
    watches = order.kind is OrderKind.WATCH
    arc_kind(order.robot, Sight.NOTHING, types, resources)  # a wrong name has its own refusal
    able = [
        one
        for one in types
        if (can := arc_abilities(one.name, types)) is not None
        and (can.gives_pictures if watches else can.reach is not None)
        and {resource.type for resource in resources}.issuperset(one.needs.values())
    ]
    bodies = {resource.type for resource in resources if resource.name == order.robot}
    if not any(one.needs.get(one.abilities.body, "") in bodies for one in able):
        what = "gives no pictures to this mission" if watches else "cannot drive"
        raise CannotOrder(f"{order.robot} {what}", robot=order.robot)
    return arc_kind(order.robot, Sight.PICTURES if watches else Sight.NOTHING, able, resources)


def behavior_of(console: str, number: int) -> str:
    """Return the name of the behavior that carries out an order.

    Example:
        >>> behavior_of("console-7", 3)
        'console-7-order-3'
    """
    return f"{console}-order-{number}"


def operator_of(request: RequestView) -> str:
    """Return the owner of a request; for the behavior of an order, the console that gave the order."""
    kind, _, console = request.priority.partition(":")[0].partition(" ")  # the first node of its path, see ``start_of``
    is_order = kind == "console" and component_of(request.owner).startswith(f"{console}-order-")
    return f"{Subsystem.UI_CONSOLE}/{console}" if is_order else request.owner


def start_of(
    order: Order,
    number: int,
    kind: str,
    localizer: FoundLocalizer | None,
    *,
    console: str,
    priority: int,
    runtime_s: float,
) -> Start:
    """Return the launch of an order's behavior.

    Its path is the console's path with one more node. So the stick has priority over the order, the order has priority
    over everything below the console, and the orders of a console are equal and share resources in turns.

    Args:
        kind: Of the ARC.
        localizer: The localizer; None: the order needs none.
        console: Address of the console.
        priority: Priority of the console, among the consoles and the mission.
        runtime_s: Shortest useful time, seconds.
    """
    name = behavior_of(component_of(console), number)
    own: dict[str, object] = {"localizer": localizer.address} if localizer is not None else {}
    if order.kind is OrderKind.GO_TO:
        own |= {"x_m": order.x_m, "y_m": order.y_m}
    elif order.kind is OrderKind.FOLLOW:
        own |= {"target": order.target}
    arc = {"kind": kind, "minimum_runtime_s": runtime_s, "wish": {ROBOT: order.robot}}
    path = [[component_of(console), priority], [name, EQUAL]]
    return Start(order.kind.value, name, {**own, "path": path, "arc": arc, "children": [], "keeper": console})
