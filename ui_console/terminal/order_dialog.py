"""The dialog of orders: what one robot, or all that the operator holds, are to do by themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from ui_console.model.orders import Order, OrderKind, group
from ui_console.terminal.dialogs import FIELD_REMARK, Dialog, Field

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


@dataclass(frozen=True, slots=True)
class _Choice:
    """One line of the list."""

    kind: OrderKind
    robots: tuple[str, ...]
    text: str


class OrderDialog(Dialog[Sequence[Order]]):
    """Choose an order, then fill in its fields; answers with the order of each robot.

    Args:
        robot: The robot at the stick.
        held: The robots that the operator has; with two or more of them each order can be given to all.
    """

    def __init__(self, robot: str, held: Sequence[str]) -> None:
        super().__init__()
        self._robot = robot
        self._choices = [_Choice(kind, (robot,), words) for kind, words in WORDS.items()]
        every = tuple(sorted({robot, *held}))
        if len(every) > 1:
            self._choices += [_Choice(kind, every, f"all {len(every)}: {words}") for kind, words in WORDS.items()]
        self._chosen: _Choice | None = None

    @property
    def subject(self) -> str:
        """The robot at the stick."""
        return self._robot

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        with Vertical(id="order") as box:
            box.border_title = f"what is {self._robot} to do by itself? (enter chooses it)"
            yield OptionList(*(Option(choice.text) for choice in self._choices))

    async def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer, or ask for the order's fields first."""
        if self._chosen is not None:
            return
        chosen = self._chosen = self._choices[event.option_index]
        labels = LABELS.get(chosen.kind, ())
        if not labels:
            self._order(chosen, Order(chosen.kind, self._robot))
            return
        box = self.query_one("#order", Vertical)
        await box.remove_children()
        box.border_title = f"{chosen.text} (enter gives the order)"
        for label in labels:
            field = Field("")
            field.cursor_blink = False
            await box.mount(Static(Text(label)), field)
        await box.mount(Static(Text(FIELD_REMARK), classes="remark", id="fault"))
        self.query(Field).first().focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go to the next field; after the last one answer, or say which value is wrong."""
        fields = list(self.query(Field))
        following = fields[fields.index(event.input) + 1 :] if isinstance(event.input, Field) else []
        if following:
            following[0].focus()
        elif (chosen := self._chosen) is not None:
            try:
                order = order_of(chosen.kind, self._robot, [field.value for field in fields])
            except ValueError as wrong:
                self.query_one("#fault", Static).update(Text(str(wrong), "bold red"))
                return
            self._order(chosen, order)

    def _order(self, chosen: _Choice, order: Order) -> None:
        self.answer(group(order, chosen.robots))


def order_of(kind: OrderKind, robot: str, values: Sequence[str]) -> Order:
    """Return the order with these values, as they were typed.

    Raises:
        ValueError: One is missing or no number; the text says which.

    Example:
        >>> order_of(OrderKind.GO_TO, "scout1", ["2", " 1.5"])
        Order(kind=<OrderKind.GO_TO: 'go_to'>, robot='scout1', x_m=2.0, y_m=1.5, target='', then_release=False)
    """
    if kind is OrderKind.FOLLOW:
        target = values[0].strip()
        if not target:
            raise ValueError("type the name of a robot, or of another body")
        return Order(kind, robot, target=target)
    x_m, y_m = (_meters(value) for value in values)
    return Order(kind, robot, x_m, y_m)


def _meters(value: str) -> float:
    try:
        meters = float(value.replace(",", "."))
    except ValueError:
        raise ValueError(f"{value!r} is no number of meters") from None
    if not math.isfinite(meters):
        raise ValueError(f"{value!r} is no number of meters")
    return meters
