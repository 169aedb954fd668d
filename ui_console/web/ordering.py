"""Ordering: converts a person's taps on a page into orders for robots."""

from __future__ import annotations

from ui_console.model.orders import Order, OrderKind, group, inside
from ui_console.model.team import TeamModel
from ui_console.web.protocol import OrderRequest, PictureOrder


class Ordering:
    """The taps of one person."""

    def __init__(self, team: TeamModel) -> None:
        self._team = team
        self._captured_s: dict[str, float] = {}

    def drawn(self, robot: str, captured_s: float) -> None:
        """Record that the page shows the picture of this time, because a tap in it refers to the robot's place then."""
        self._captured_s[robot] = captured_s

    def orders_for(self, intent: OrderRequest | PictureOrder) -> list[Order]:
        """Return one order for each robot; goals are side by side, on the floor.

        Raises:
            NoFloorThere: No place on the floor can be determined for the point of the picture.
        """
        match intent:
            case OrderRequest(kind=kind, robots=robots, x_m=x_m, y_m=y_m, target=target):
                order = Order(kind, "", x_m, y_m, target)
            case PictureOrder(robot=robot, robots=robots, column_px=column_px, row_px=row_px):
                seen_s = self._captured_s.get(robot, 0.0)
                size_px = intent.width_px, intent.height_px
                x_m, y_m = self._team.map.pick(robot, column_px, row_px, size_px, seen_s)
                order = Order(OrderKind.GO_TO, "", round(x_m, 2), round(y_m, 2))
        return inside(group(order, robots), self._team.map.floor)
