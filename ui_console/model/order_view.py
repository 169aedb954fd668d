"""View of one order, as screens and pages show it."""

from __future__ import annotations

import msgspec

from ui_console.model.orders import OrderKind, OrderState


class OrderView(msgspec.Struct, frozen=True):
    """An order of this console's operator that goes on, or was over a moment ago.

    Attributes:
        robot: Its robot.
        kind: Type of the behavior that carries it out.
        number: Of the order, at this console.
        words: The order, for people: ``go to 2, 1``.
        state: Its state; done, failed and ended are final.
        why: Why it waits, failed or ended, or what its behavior told at the end; may be empty.
        by: What the robot's position comes from; empty: it needs none, or that is not known yet.
        line: All of it in one line.
        x_m: Of the place to go to, meters in the room's frame; ``go_to`` only.
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
