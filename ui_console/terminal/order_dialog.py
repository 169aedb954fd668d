"""The dialog for orders to one robot, or to all robots that the operator holds."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.text import Text

from ui_console.model.fields import WrongValue
from ui_console.model.orders import Order, OrderKind, group
from ui_console.terminal.dialogs import ChoiceDialog, DialogChoice

LABELS = {
    OrderKind.GO_TO: ("x in meters, along the width of the room", "y in meters, along its depth"),
    OrderKind.FOLLOW: ("whom, by name",),
}
WORDS = {
    OrderKind.GO_TO: "go to a place",
    OrderKind.RETURN: "return to where the mission began",
    OrderKind.FOLLOW: "follow a robot or another body",
    OrderKind.WATCH: "watch for motion from where it stands",
}


def order_dialog(robot: str, held: Sequence[str]) -> ChoiceDialog[Sequence[Order]]:
    """Return the dialog; its answer is the order of each robot.

    Args:
        robot: The robot at the stick.
        held: The operator's robots; if there are two or more, each order can be given to all.
    """
    every = tuple(sorted({robot, *held}))
    groups = {"": (robot,)} | ({f"all {len(every)}: ": every} if len(every) > 1 else {})
    choices = [_choice(kind, robot, robots, who) for who, robots in groups.items() for kind in WORDS]
    return ChoiceDialog(f"what is {robot} to do by itself? (enter chooses it)", choices, robot=robot)


def _choice(kind: OrderKind, robot: str, robots: tuple[str, ...], who: str) -> DialogChoice[Sequence[Order]]:
    words = who + WORDS[kind]
    fields = [(label, "") for label in LABELS.get(kind, ())]
    title = f"{words} (enter gives the order)"
    return DialogChoice(Text(words), lambda values: group(order_of(kind, robot, values), robots), title, fields)


def order_of(kind: OrderKind, robot: str, values: Sequence[str]) -> Order:
    """Return the order with these typed values.

    Raises:
        WrongValue: A value is missing or is not a number.

    Example:
        >>> order_of(OrderKind.GO_TO, "scout1", ["2", " 1.5"])
        Order(kind=<OrderKind.GO_TO: 'go_to'>, robot='scout1', x_m=2.0, y_m=1.5, target='', then_release=False)
    """
    if kind not in LABELS:
        return Order(kind, robot)
    if kind is OrderKind.FOLLOW:
        target = values[0].strip()
        if not target:
            raise WrongValue("no name was typed", remedy="Type the name of a robot, or of another body.")
        return Order(kind, robot, target=target)
    x_m, y_m = (_meters(value) for value in values)
    return Order(kind, robot, x_m, y_m)


def _meters(value: str) -> float:
    try:
        meters = float(value.replace(",", "."))
    except ValueError:
        meters = math.nan
    if not math.isfinite(meters):
        raise WrongValue(f"{value!r} is no number of meters", remedy="Type a number, as 2.5.")
    return meters
