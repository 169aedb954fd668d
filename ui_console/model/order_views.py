"""Orders of one operator as a screen shows them: the newest of each robot, and how it ended, for a moment. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec

from resource_pool.arc_client import FloorPlan
from ui_console.model.events import OrderChanged
from ui_console.model.orders import Order, OrderKind

OVER_SHOWN_S = 20.0  # chosen: an operator of several robots looks away for a while; mission seconds
EDGE_M = 0.3  # chosen: a place for a rover of 45 cm beside a wall


class OrderView(msgspec.Struct, frozen=True):
    """One order.

    Attributes:
        robot: Who carries it out.
        kind: What it is to do.
        x_m: The place to go to; 0 if the order has none.
        y_m: Same.
        line: The order and its state, for people.
        is_over: True: it is done, failed or ended.
        has_stick: True: the operator's stick is at this robot, and takes it from the order.
    """

    robot: str
    kind: OrderKind
    x_m: float
    y_m: float
    line: str
    is_over: bool
    has_stick: bool


class OrderList:
    """The orders of one operator."""

    def __init__(self) -> None:
        self._newest: dict[str, OrderChanged] = {}

    def take(self, changed: OrderChanged) -> None:
        """Take in that an order was given, or changed; an older order of the robot does not come back."""
        robot, known = changed.given.order.robot, self._newest.get(changed.given.order.robot)
        if known is None or known.given.number <= changed.given.number:
            self._newest[robot] = changed

    def views(self, now_s: float, stick: str) -> list[OrderView]:
        """Return the orders that go on, and those that ended lately, by robot.

        Args:
            now_s: Mission time.
            stick: The robot that the operator's stick is at; empty: none.
        """
        shown = [
            changed
            for _, changed in sorted(self._newest.items())
            if not changed.given.state.is_final or now_s < changed.at_s + OVER_SHOWN_S
        ]
        return [
            OrderView(
                robot=given.order.robot,
                kind=given.order.kind,
                x_m=given.order.x_m,
                y_m=given.order.y_m,
                line=given.line,
                is_over=given.state.is_final,
                has_stick=given.order.robot == stick and not given.state.is_final,
            )
            for given in (changed.given for changed in shown)
        ]


def inside(orders: Sequence[Order], floor: FloorPlan | None) -> list[Order]:
    """Return the orders of a group with their places moved together, as far as needed, so that none is off the floor.

    A group that is wider than the floor begins at its edge. A robot that goes alone goes to the place as it was tapped.

    Example:
        >>> wide = [Order(OrderKind.GO_TO, "scout1", -0.25, 1.0), Order(OrderKind.GO_TO, "scout2", 0.25, 1.0)]
        >>> [each.x_m for each in inside(wide, FloorPlan(4.0, 3.0))]
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
