"""View of one order, for screens and pages."""

from __future__ import annotations

import msgspec

from ui_console.model.orders import OrderKind, OrderState


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
