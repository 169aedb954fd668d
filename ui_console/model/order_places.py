"""Goals of the orders of a group, kept on the floor. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from resource_pool.arc_client import FloorPlan
from ui_console.model.orders import Order, OrderKind

EDGE_M = 0.3  # chosen: distance from a wall for a robot of 45 cm


def inside(orders: Sequence[Order], floor: FloorPlan | None) -> list[Order]:
    """Return the orders of a group with their goals shifted together, so that no goal is off the floor.

    A group that is wider than the floor begins at the floor's edge. A single robot goes exactly to the tapped place.

    Example:
        >>> wide = [Order(OrderKind.GO_TO, "scout1", -0.25, 1.0), Order(OrderKind.GO_TO, "scout2", 0.25, 1.0)]
        >>> [round(each.x_m, 3) for each in inside(wide, FloorPlan(4.0, 3.0))]
        [0.3, 0.8]
    """
    places = [order for order in orders if order.kind is OrderKind.GO_TO]
    if floor is None or len(places) < 2:
        return list(orders)
    right_m = _shift_m([order.x_m for order in places], floor.width_m)
    up_m = _shift_m([order.y_m for order in places], floor.depth_m)
    return [
        replace(order, x_m=order.x_m + right_m, y_m=order.y_m + up_m) if order.kind is OrderKind.GO_TO else order
        for order in orders
    ]


def _shift_m(places_m: list[float], far_m: float) -> float:
    first_m, last_m = min(places_m), max(places_m)
    return max(EDGE_M - first_m, 0.0) or min(far_m - EDGE_M - last_m, 0.0)
