"""Orders: what an operator tells a robot to do by itself. Pure.

An order is a behavior that the console starts for one robot with the operator's priority. The robot carries it out
until it is done, until the operator touches the stick or gives another order, or until the operator gives it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum


class OrderKind(StrEnum):
    """What a robot can be told to do; the value is the type of the behavior that does it."""

    GO_TO = "go_to"  # drive to a place
    WATCH = "watch_for_motion"  # watch from where it stands
    RETURN = "return_home"  # drive to the place where it stood when the mission began
    FOLLOW = "follow"  # drive after another robot or body


@dataclass(frozen=True, slots=True)
class Order:
    """One order for one robot.

    Attributes:
        robot: Name of the robot.
        x_m: Of the place to go to, in the room's frame; ``GO_TO`` only.
        y_m: Same.
        target: Name of the body to follow; ``FOLLOW`` only.
    """

    kind: OrderKind
    robot: str
    x_m: float = 0.0
    y_m: float = 0.0
    target: str = ""


APART_M = 0.5  # chosen: two Scouts of 11 cm pass each other, and a rover of 45 cm has a place of its own


def group(order: Order, robots: Sequence[str]) -> list[Order]:
    """Return the order for each of these robots; places to go to lie side by side, ``APART_M`` from each other.

    Example:
        >>> [(each.robot, each.x_m) for each in group(Order(OrderKind.GO_TO, "", 2.0, 1.0), ["scout1", "scout2"])]
        [('scout1', 1.75), ('scout2', 2.25)]
    """
    apart_m = APART_M if order.kind is OrderKind.GO_TO else 0.0
    first_m = order.x_m - apart_m * (len(robots) - 1) / 2
    return [replace(order, robot=robot, x_m=first_m + apart_m * place) for place, robot in enumerate(robots)]
