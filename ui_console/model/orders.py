"""Orders: tasks that a robot carries out by itself for an operator. Pure.

An order is a behavior that the console starts for one robot with the operator's priority. It runs until it is done,
until the operator touches the stick or gives another order, or until the operator releases the robot. ``OrderBook``
decides the reactions to these events.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from resource_pool.arc_client import FloorPlan

EDGE_M = 0.3  # chosen: distance from a wall for a robot of 45 cm


class OrderKind(StrEnum):
    """Kinds of orders; the value is the type of the behavior that carries the order out."""

    GO_TO = "go_to"  # drive to a place
    WATCH = "watch_for_motion"  # watch from its present place
    RETURN = "return_home"  # drive to its place at the begin of the mission
    FOLLOW = "follow"  # follow another robot or body


@dataclass(frozen=True, slots=True)
class Order:
    """An order for one robot.

    Attributes:
        robot: Name of the robot; empty: the one at the operator's stick.
        x_m: Goal in the room's frame; ``GO_TO`` only.
        y_m: Same.
        target: Name of the body to follow; ``FOLLOW`` only.
        then_release: The robot is given back when the order is done or failed; False: the operator has it again.
    """

    kind: OrderKind
    robot: str
    x_m: float = 0.0
    y_m: float = 0.0
    target: str = ""
    then_release: bool = False

    @property
    def sentence(self) -> str:
        """The order in words for people, without the robot.

        Example:
            >>> Order(OrderKind.GO_TO, "scout1", 2.0, 1.25).sentence
            'go to 2, 1.25'
        """
        match self.kind:
            case OrderKind.GO_TO:
                return f"go to {self.x_m:g}, {self.y_m:g}"
            case OrderKind.WATCH:
                return "watch from here"
            case OrderKind.RETURN:
                return "return"
            case OrderKind.FOLLOW:
                return f"follow {self.target}"


class OrderState(StrEnum):
    """State of an order; done, failed and ended are final."""

    STARTING = "starting"  # its behavior is starting; the stick keeps the robot until the behavior is ready
    RUNNING = "running"  # the robot carries it out
    WAITING = "waiting"  # the robot is stopped, or an ARC of higher priority has it
    DONE = "done"  # its behavior has finished
    FAILED = "failed"  # its behavior cannot reach its aim, was refused, or is gone
    ENDED = "ended"  # the operator touched the stick, gave another order, or gave the robot back

    @property
    def is_final(self) -> bool:
        """True if the state is final."""
        return self in (OrderState.DONE, OrderState.FAILED, OrderState.ENDED)


@dataclass(frozen=True, slots=True)
class GivenOrder:
    """A given order and its present state.

    Attributes:
        number: Number of the order, from 1, unique at its console.
        why: Why it waits, failed or ended; for a done order, the report of its behavior; may be empty.
        by: Source of the robot's position, for people; empty: not needed, or not known yet.
    """

    order: Order
    number: int
    state: OrderState = OrderState.STARTING
    why: str = ""
    by: str = ""

    @property
    def line(self) -> str:
        """The order and its state in one line for people.

        Example:
            >>> GivenOrder(Order(OrderKind.RETURN, "scout1"), 3, OrderState.WAITING, "stopped by anna").line
            'scout1: return (waiting: stopped by anna)'
        """
        remarks = [f"{self.state}: {self.why}" if self.why else str(self.state)]
        if self.by and not self.state.is_final:
            remarks.append(self.by)
        return f"{self.order.robot}: {self.order.sentence} ({'; '.join(remarks)})"


APART_M = 0.5  # chosen: robots of 11 cm can pass each other, and a robot of 45 cm has room


def group(order: Order, robots: Sequence[str]) -> list[Order]:
    """Return the order for each of these robots; goals are side by side, ``APART_M`` from each other.

    Example:
        >>> [(each.robot, each.x_m) for each in group(Order(OrderKind.GO_TO, "", 2.0, 1.0), ["scout1", "scout2"])]
        [('scout1', 1.75), ('scout2', 2.25)]
    """
    apart_m = APART_M if order.kind is OrderKind.GO_TO else 0.0
    first_m = order.x_m - apart_m * (len(robots) - 1) / 2
    return [replace(order, robot=robot, x_m=first_m + apart_m * place) for place, robot in enumerate(robots)]


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
