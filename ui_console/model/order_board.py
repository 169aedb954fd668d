"""Order board: the orders of one operator, for screens. Pure."""

from __future__ import annotations

import msgspec

from ui_console.model.events import OrderChanged
from ui_console.model.orders import GivenOrder, OrderKind, OrderState

SHOWN_S = 10.0  # chosen: long enough to be read, short enough not to be mistaken for news


class OrderView(msgspec.Struct, frozen=True):
    """An order of this console's operator that is unfinished, or ended a moment ago.

    Attributes:
        robot: Its robot.
        kind: Type of the behavior that carries it out.
        number: Number of the order at this console.
        words: The order, for people: ``go to 2, 1``.
        state: Its state; done, failed and ended are final.
        why: Why it waits, failed or ended, or the final report of its behavior; may be empty.
        by: Source of the robot's position; empty: not needed, or not known yet.
        line: All of it in one line.
        x_m: Goal, meters in the room's frame; ``go_to`` only.
        y_m: Same.
        target: The body to follow; ``follow`` only.
    """

    robot: str
    kind: OrderKind
    number: int
    words: str
    state: OrderState
    why: str
    by: str
    line: str
    x_m: float
    y_m: float
    target: str


class OrderBoard:
    """The newest order of each robot."""

    def __init__(self) -> None:
        self._newest: dict[str, OrderChanged] = {}

    def take(self, changed: OrderChanged) -> None:
        """Record a change; an earlier order of the robot is dropped, and its later end is ignored."""
        robot, given = changed.given.order.robot, changed.given
        known = self._newest.get(robot)
        if known is None or known.given.number <= given.number:
            self._newest[robot] = changed

    def of(self, robot: str) -> GivenOrder | None:
        """Return the unfinished order of this robot; None: there is none."""
        known = self._newest.get(robot)
        return known.given if known is not None and not known.given.state.is_final else None

    def views(self, now_s: float) -> list[OrderView]:
        """Return the unfinished orders, and the orders that ended a moment ago, by robot."""
        return [
            OrderView(
                robot=robot,
                kind=given.order.kind,
                number=given.number,
                words=given.order.sentence,
                state=given.state,
                why=given.why,
                by=given.by,
                line=given.line,
                x_m=given.order.x_m,
                y_m=given.order.y_m,
                target=given.order.target,
            )
            for robot, changed in sorted(self._newest.items())
            for given in [changed.given]
            if not given.state.is_final or now_s - changed.at_s <= SHOWN_S
        ]
