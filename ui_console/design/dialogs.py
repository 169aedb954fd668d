"""What covers the designer's screen for a moment: pick one, answer one question."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.suggester import SuggestFromList
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from ui_console.design.offers import Asked
from ui_console.terminal.dialogs import CSS as DIALOG_CSS
from ui_console.terminal.dialogs import Dialog

CHOICES_TOLD = 12  # chosen: fits two lines
CSS = (
    DIALOG_CSS
    + """
Dialog { background: $background; }
Dialog OptionList { height: 12; }
Dialog #doc { margin-top: 1; height: 12; }
"""
)


class Picker(Dialog[int | None]):
    """Pick one of a list by cursor or by typing a part of it; what it is stands below. Answers its number."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("down", "move(1)", "down", show=False),
        Binding("up", "move(-1)", "up", show=False),
    ]

    def __init__(self, title: str, labels: Sequence[str], docs: Sequence[Sequence[str]]) -> None:
        super().__init__()
        self._title, self._labels, self._docs = title, labels, docs

    def compose(self) -> ComposeResult:
        """Lay out filter, list and explanation."""
        with Vertical() as box:
            box.border_title = self._title
            field = Input(placeholder="type a part of its name")
            field.cursor_blink = False
            yield field
            options = OptionList()
            options.can_focus = False
            yield options
            yield Static(id="doc")

    def on_mount(self) -> None:
        """Show all."""
        self._show("")

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show those that have what was typed."""
        self._show(event.value)

    def on_input_submitted(self, _event: Input.Submitted) -> None:
        """Answer."""
        number = self._number()
        if number is not None:
            self.answer(number)

    def on_option_list_option_highlighted(self, _event: OptionList.OptionHighlighted) -> None:
        """Explain it."""
        number = self._number()
        lines = [] if number is None else self._docs[number]
        self.query_one("#doc", Static).update(Text("\n".join(lines)), layout=False)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer a mouse."""
        self.answer(int(event.option.id or 0))

    def action_move(self, steps: int) -> None:
        """Move in the list."""
        options = self.query_one(OptionList)
        if steps > 0:
            options.action_cursor_down()
        else:
            options.action_cursor_up()

    def _show(self, part: str) -> None:
        options = self.query_one(OptionList)
        options.clear_options()
        shown = [number for number, label in enumerate(self._labels) if part.strip().lower() in label.lower()]
        options.add_options(Option(Text(self._labels[number]), id=str(number)) for number in shown)
        options.highlighted = 0 if shown else None

    def _number(self) -> int | None:
        options = self.query_one(OptionList)
        if options.highlighted is None:
            return None
        return int(options.get_option_at_index(options.highlighted).id or 0)


class Ask(Dialog[str | None]):
    """Ask for one value; the right arrow takes what is suggested. Answers what was typed."""

    def __init__(self, asked: Asked) -> None:
        super().__init__()
        self._asked = asked

    def compose(self) -> ComposeResult:
        """Lay out meaning, choices and field."""
        with Vertical() as box:
            box.border_title = self._asked.name
            told = ", ".join(self._asked.choices[:CHOICES_TOLD])
            more = ", …" if len(self._asked.choices) > CHOICES_TOLD else ""
            lines = [self._asked.doc, *([f"One of: {told}{more}"] if told else [])]
            yield Static(Text("\n".join(line for line in lines if line)))
            suggester = SuggestFromList(self._asked.choices) if self._asked.choices else None
            field = Input(self._asked.proposed, select_on_focus=True, suggester=suggester)
            field.cursor_blink = False
            yield field

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer."""
        self.answer(event.value)


class Sure(Dialog[bool | None]):
    """Ask whether to go on; answers True for ``y``."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("y", "yes", "yes"), Binding("n", "close", "no")]

    def __init__(self, question: str) -> None:
        super().__init__()
        self._question = question

    def compose(self) -> ComposeResult:
        """Lay out the question."""
        with Vertical() as box:
            box.border_title = "sure?"
            yield Static(Text(f"{self._question}\ny: yes, n: no"))

    def action_yes(self) -> None:
        """Answer."""
        self.answer(True)
