"""Dialogs over the screen: pick a robot, read a reason, change a parameter, give a command, lift a stop.

Drive keys do nothing while a dialog is open, so the wheels stop by themselves. The keys of the emergency stop work in
dialogs, too, even while a line is typed.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from backbone.spoken import counted
from ui_console.model.arc_abilities import RoleCommand
from ui_console.model.driving import GiveWish
from ui_console.model.fields import WrongValue, default_text, read_fields
from ui_console.model.views import StopView
from ui_console.terminal.keys import STOP_KEYS
from ui_console.terminal.lines import Row, lift_lines

T = TypeVar("T")
CSS = """
Dialog { align: center middle; }
/* min-width: Textual cannot lay out a list without a column */
Dialog > Vertical { width: 90%; min-width: 20; max-width: 100; height: auto; max-height: 90%; padding: 0 1; }
Dialog > Vertical { border: thick $primary; background: $surface; }
Dialog OptionList { height: auto; max-height: 20; }
Dialog VerticalScroll { height: auto; max-height: 100%; }
ViewDialog > Vertical { height: 90%; }
ViewDialog Video { height: 1fr; }
KeyPicker > Vertical, KeyDialog > Vertical { height: 90%; max-width: 100%; }
KeyDialog Video, Dialog DataTable { height: 1fr; }
KeyDialog #plot-room { height: 6; align-horizontal: right; }
KeyDialog Sparkline { height: 100%; }
Dialog .remark { color: $text-muted; }
"""
READ_S = 0.5  # chosen: less than a person needs to read a line
FIELD_REMARK = "x and X stop robots here too; ctrl+x types an x"


def can_stop(app: App[object]) -> bool:
    """Return whether this screen can stop robots; False for a recording."""
    return bool(app.check_action("stop_all", ()))


def field_remark(app: App[object]) -> str:
    """Return the remark before typing; empty: each key is text."""
    return FIELD_REMARK if can_stop(app) else ""


class Dialog(ModalScreen[T]):
    """Base class of all dialogs; escape closes a dialog without effect."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "close", "close")]

    @property
    def subject(self) -> str:
        """The name under the dialog's cursor; empty: no cursor."""
        return ""

    def answer(self, result: T | None) -> None:
        """Close with this answer; if a burst of keys gives several answers, the first counts."""
        if self.is_active:
            self.dismiss(result)

    def action_close(self) -> None:
        """Close the dialog."""
        self.answer(None)


class Field(Input):
    """A line to type in; on a screen that can stop robots, the keys of the emergency stop are never typed."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("ctrl+x", "type_x", "type an x", show=False)]

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """Return whether the key is text; on a screen that can stop robots, the keys of the emergency stop are not."""
        is_stop = key in STOP_KEYS and can_stop(self.app)
        return not is_stop and super().check_consume_key(key, character)

    def action_type_x(self) -> None:
        """Type an x."""
        self.replace("x", *self.selection)


class RobotPicker(Dialog[str]):
    """Pick the robot to drive next; the answer is its name.

    Args:
        robots: Robots to choose from.
        robot: The console's own robot: the cursor begins there, so that a hasty stop is for this robot.
    """

    def __init__(self, robots: list[Row], robot: str) -> None:
        super().__init__()
        self._robots, self._robot = robots, robot

    @property
    def subject(self) -> str:
        """The robot under the cursor; empty before the list is shown."""
        chosen = [options.highlighted for options in self.query(OptionList)]
        return "".join(self._robots[number].subject for number in chosen if number is not None)

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        with Vertical() as box:
            box.border_title = "which robot? (enter takes it)"
            robots = OptionList(*(Option(row.text, id=row.subject) for row in self._robots))
            robots.highlighted = next((at for at, row in enumerate(self._robots) if row.subject == self._robot), 0)
            yield robots

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer."""
        self.answer(event.option.id)


class Reading(Dialog[None]):
    """A text to read, with the cursor keys if it is long."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter,space,q", "close", "close")]

    def __init__(self, title: str, lines: Sequence[str]) -> None:
        super().__init__()
        self._title, self._lines = title, lines

    def compose(self) -> ComposeResult:
        """Lay out the text."""
        with Vertical() as box:
            box.border_title = self._title
            with VerticalScroll():
                yield Static(Text("\n".join(self._lines)), id="reading")


class LineQuestion(Dialog[str]):
    """Ask for one line; the answer is the typed line.

    Args:
        title: The question.
        value: The initial line.
        remark: Help on the line's format.
    """

    def __init__(self, title: str, value: str = "", remark: str = "") -> None:
        super().__init__()
        self._title, self._value, self._remark = title, value, remark

    def compose(self) -> ComposeResult:
        """Lay out the field."""
        with Vertical() as box:
            box.border_title = self._title
            field = Field(self._value, select_on_focus=True)
            field.cursor_blink = False
            yield field
            remarks = [line for line in (self._remark, field_remark(self.app)) if line]
            yield Static(Text("\n".join(remarks)), classes="remark")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer."""
        self.answer(event.value)


@dataclass(frozen=True, slots=True)
class DialogChoice(Generic[T]):
    """One line of a ``ChoiceDialog``.

    Attributes:
        line: The line.
        result: Returns the answer for the typed values, or raises ``WrongValue``.
        title: Title of its fields.
        fields: Label and first text of each of them.
    """

    line: Text
    result: Callable[[list[str]], T]
    title: str = ""
    fields: Sequence[tuple[str, str]] = ()


class ChoiceDialog(Dialog[T]):
    """Choose a line, then fill in its fields, if any; the answer is the result of the choice.

    Args:
        question: Title of the list.
        choices: Lines to choose from.
        robot: The robot concerned; empty: none.
        begins_at: Number of the line at which the cursor begins.
    """

    def __init__(
        self, question: str, choices: Sequence[DialogChoice[T]], *, robot: str = "", begins_at: int = 0
    ) -> None:
        super().__init__()
        self._question, self._choices, self._robot, self._begins_at = question, choices, robot, begins_at
        self._chosen: DialogChoice[T] | None = None

    @property
    def subject(self) -> str:
        """The robot; empty: none."""
        return self._robot

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        with Vertical(id="choice") as box:
            box.border_title = self._question
            options = OptionList(*(Option(choice.line) for choice in self._choices))
            options.highlighted = self._begins_at
            yield options

    async def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer, or ask for the fields of the choice first."""
        if self._chosen is not None:
            return
        chosen = self._chosen = self._choices[event.option_index]
        if not chosen.fields:
            self.answer(chosen.result([]))
            return
        box = self.query_one("#choice", Vertical)
        await box.remove_children()
        box.border_title = chosen.title
        for label, text in chosen.fields:
            field = Field(text, select_on_focus=True)
            field.cursor_blink = False
            await box.mount(Static(Text(label)), field)
        await box.mount(Static(Text(field_remark(self.app)), classes="remark", id="fault"))
        self.query(Field).first().focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go to the next field; after the last one, answer or show which value is wrong."""
        fields = list(self.query(Field))
        following = fields[fields.index(event.input) + 1 :] if isinstance(event.input, Field) else []
        if following:
            following[0].focus()
        elif self._chosen is not None:
            try:
                self.answer(self._chosen.result([field.value for field in fields]))
            except WrongValue as wrong:
                self.query_one("#fault", Static).update(Text(f"{wrong.detail}. {wrong.remedy}", "bold red"))


def command_dialog(robot: str, commands: Sequence[RoleCommand]) -> ChoiceDialog[GiveWish]:
    """Return the dialog that answers with one of these commands of the robot."""
    question = f"which command for {robot}? (enter chooses it)"
    return ChoiceDialog(question, list(map(_command_choice, commands)), robot=robot)


def _command_choice(command: RoleCommand) -> DialogChoice[GiveWish]:
    form = command.form
    labels = zip(command.labels, form.fields, strict=True)
    return DialogChoice(
        Text.assemble((command.title, "bold"), f"  {form.doc}" if form.doc else ""),
        lambda values: GiveWish(form.word, read_fields(form.fields, values), command.role),
        f"{command.title} (enter gives it)",
        [(f"{label}{f'  {field.doc}' if field.doc else ''}", default_text(field)) for label, field in labels],
    )


class LiftQuestion(Dialog[int]):
    """Ask whether to lift a stop; the confirming key differs from the opening key. The answer is the stop's number.

    Args:
        robot: The stopped robot.
        stop: The stop to lift, as it is now.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("l", "lift", "lift it")]

    def __init__(self, robot: str, stop: StopView) -> None:
        super().__init__()
        self._robot, self._stop, self._changed_s = robot, stop, -READ_S

    @property
    def subject(self) -> str:
        """The robot that is stopped."""
        return self._robot

    def compose(self) -> ComposeResult:
        """Lay out the question."""
        with Vertical() as box:
            box.border_title = f"lift the stop of {self._robot}?"
            yield Static(self._text(), id="stop")

    def look(self, stop: StopView | None) -> None:
        """Show the present state of the stop; if there is none any more, close."""
        if stop is None:
            self.answer(None)
            return
        if stop.number != self._stop.number:
            self._changed_s = asyncio.get_running_loop().time()
        self._stop = stop
        for shown in self.query("#stop").results(Static):  # no widget before the layout, which shows the newest state
            shown.update(self._text())

    def action_lift(self) -> None:
        """Answer, unless the dialog has shown this stop for less than ``READ_S``, too short to read it."""
        if asyncio.get_running_loop().time() - self._changed_s >= READ_S:
            self.answer(self._stop.number)

    def _text(self) -> Text:
        return Text("\n".join([*lift_lines(self._stop), "", "l: lift it   escape: leave it stopped"]))


class OwnLiftQuestion(Dialog[Mapping[str, int]]):
    """Ask whether to lift all stops that only this operator set; the answer is the stops in question.

    A robot that was stopped again since the dialog opened has another number, and stays stopped.

    Args:
        stops: Robot → number of its stop.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("l", "lift", "lift them")]

    def __init__(self, stops: Mapping[str, int]) -> None:
        super().__init__()
        self._stops = stops

    def compose(self) -> ComposeResult:
        """Lay out the question."""
        with Vertical() as box:
            box.border_title = f"lift your {counted(len(self._stops), 'stop')}?"
            keys = "l: lift all of them   escape: leave them stopped"
            yield Static(Text(f"{keys}\n\nbehaviors move these robots at once: {', '.join(self._stops)}"))

    def action_lift(self) -> None:
        """Answer."""
        self.answer(self._stops)
