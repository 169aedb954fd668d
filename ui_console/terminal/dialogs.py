"""What covers the screen for a moment: pick a robot, read a reason, change a parameter.

Drive keys do nothing meanwhile, so the wheels stop by themselves; the emergency stop of all robots works here too.
"""

from __future__ import annotations

from typing import ClassVar, TypeVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from ui_console.terminal.lines import Row

T = TypeVar("T")
STOP_ALL = "X"
CSS = """
Dialog { align: center middle; }
Dialog > Vertical { width: 80%; max-width: 100; height: auto; max-height: 80%; padding: 0 1; }
Dialog > Vertical { border: thick $primary; background: $surface; }
Dialog OptionList { height: auto; max-height: 20; }
"""


class Dialog(ModalScreen[T]):
    """Base of all; escape closes it and changes nothing."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "close", "close"),
        Binding(STOP_ALL, "app.stop_all", "STOP ALL"),
    ]

    def action_close(self) -> None:
        """Close it."""
        self.dismiss(None)


class RobotPicker(Dialog[str]):
    """Pick the robot to drive next; answers its name."""

    def __init__(self, robots: list[Row]) -> None:
        super().__init__()
        self._robots = robots

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        with Vertical() as box:
            box.border_title = "which robot? (enter takes it)"
            yield OptionList(*(Option(row.text, id=row.subject) for row in self._robots))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer."""
        self.dismiss(event.option.id)


class Reading(Dialog[None]):
    """Something to read."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter,space,q", "close", "close")]

    def __init__(self, title: str, lines: list[str]) -> None:
        super().__init__()
        self._title, self._lines = title, lines

    def compose(self) -> ComposeResult:
        """Lay out the text."""
        with Vertical() as box:
            box.border_title = self._title
            yield Static(Text("\n".join(self._lines)), id="reading")


class Question(Dialog[str]):
    """Ask for one line; answers what was typed."""

    def __init__(self, title: str, value: str = "") -> None:
        super().__init__()
        self._title, self._value = title, value

    def compose(self) -> ComposeResult:
        """Lay out the field."""
        with Vertical() as box:
            box.border_title = self._title
            field = Input(self._value, select_on_focus=True)
            field.cursor_blink = False
            yield field

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer."""
        self.dismiss(event.value)
