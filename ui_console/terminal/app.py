"""The console in a terminal: live picture, who holds what and why, keys to drive.

Widgets are thin: what they show is in ``ConsoleModel``, what keys do is in the session.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.events import AppBlur
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Footer, Static

from ui_console.console_model import ConsoleModel
from ui_console.driving import Direction, Drive, drive_towards
from ui_console.terminal.lines import Row, alarm_rows, request_rows, robot_rows, status_text
from ui_console.terminal.video import fit, row_segments, shrink

REDRAW_EVERY_S = 0.1  # chosen: 10 pictures a second are enough to drive by and leave the CPU to the mission
ALARMS_SHOWN = 8
SPEED_RAD_S, SPEED_STEP_RAD_S, SPEED_MOST_RAD_S = 4.0, 1.0, 15.0  # chosen: a walk, fine steps, a Scout's most


class Session(Protocol):
    """What the keys of a console do."""

    model: ConsoleModel

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, grey levels, shape (height, width), or None."""

    def now_s(self) -> float:
        """Return the mission time."""

    def hold(self, drive: Drive) -> None:
        """A drive key is down."""

    def stop(self) -> None:
        """Stop the wheels now."""

    def jump(self) -> None:
        """Jump once."""

    def take(self) -> None:
        """Ask for the robot."""

    def release(self) -> None:
        """Give the robot back."""


class Video(Widget):
    """The newest picture, as large as fits."""

    def __init__(self, newest: Callable[[], NDArray[np.uint8] | None]) -> None:
        super().__init__(id="video")
        self._newest = newest
        self._shown: NDArray[np.uint8] | None = None
        self._steps: NDArray[np.uint8] | None = None

    def look(self) -> None:
        """Take the newest picture; redraw if it is another one or the room has changed."""
        picture = self._newest()
        if picture is None or self.size.width == 0 or self.size.height == 0:
            return
        columns, rows = fit(picture.shape[1], picture.shape[0], self.size.width, self.size.height)
        if picture is self._shown and self._steps is not None and self._steps.shape == (2 * rows, columns):
            return
        self._shown, self._steps = picture, shrink(picture, columns, rows)
        self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return one row of cells."""
        if self._steps is None or 2 * y >= len(self._steps):
            return Strip.blank(self.size.width)
        return Strip(row_segments(self._steps, y)).adjust_cell_length(self.size.width)


class ConsoleApp(App[None]):
    """One console's screen."""

    TITLE = "scout-console"
    ENABLE_COMMAND_PALETTE = False
    CSS = """
    #status { height: 1; background: $primary-darken-2; color: $text; }
    #video { width: 2fr; }
    #side { width: 1fr; min-width: 40; }
    #robots, #schedule, #alarms { border: round $primary; height: auto; padding: 0 1; }
    #alarms { height: 1fr; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up,w", "drive('forward')", "forward"),
        Binding("down,s", "drive('backward')", "backward"),
        Binding("left,a", "drive('left')", "left"),
        Binding("right,d", "drive('right')", "right"),
        Binding("space,escape", "stop", "stop"),
        Binding("j", "jump", "jump"),
        Binding("plus,equals_sign", "faster(1)", "faster"),
        Binding("minus", "faster(-1)", "slower"),
        Binding("r", "release", "release"),
        Binding("t", "take", "take"),
        Binding("q,ctrl+c", "quit", "quit"),
    ]

    def __init__(self, session: Session, *, drives: bool = True) -> None:
        super().__init__()
        self._session, self._drives = session, drives
        self.speed_rad_s = SPEED_RAD_S

    def compose(self) -> ComposeResult:
        """Lay out: status above, picture left, tables right, keys below."""
        yield Static(id="status")
        with Horizontal():
            yield Video(self._session.picture)
            with Vertical(id="side"):
                yield Static(id="robots")
                yield Static(id="schedule")
                yield Static(id="alarms")
        yield Footer()

    def on_mount(self) -> None:
        """Begin to redraw."""
        for name in ("robots", "schedule", "alarms"):
            self.query_one(f"#{name}", Static).border_title = name
        self.query_one(Video).display = self._drives
        self.redraw()
        self.set_interval(REDRAW_EVERY_S, self.redraw)

    def redraw(self) -> None:
        """Show what the model says now."""
        if not self.query("#status"):  # the screen is just being taken down
            return
        now_s = self._session.now_s()
        view = self._session.model.view(now_s)
        self.query_one("#status", Static).update(status_text(view, self.speed_rad_s if self._drives else None, ""))
        self.query_one("#robots", Static).update(_joined(robot_rows(view.robots, now_s)))
        self.query_one("#schedule", Static).update(_joined(request_rows(view.requests, now_s)) or "nobody asks")
        self.query_one("#alarms", Static).update(_joined(alarm_rows(view.alarms, now_s)[:ALARMS_SHOWN]) or "none")
        if self._drives:
            self.query_one(Video).look()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002
        """Hide the keys that drive from those who only watch."""
        return self._drives or action not in ("drive", "stop", "jump", "faster", "release", "take")

    def action_drive(self, direction: Direction) -> None:
        """Drive while the key is held; the session ends it when no repeat comes."""
        self._session.hold(drive_towards(direction, self.speed_rad_s))

    def action_stop(self) -> None:
        """Stop the wheels now."""
        self._session.stop()

    def action_jump(self) -> None:
        """Jump once."""
        self._session.jump()

    def action_faster(self, steps: int) -> None:
        """Change the speed of the drive keys."""
        wanted = self.speed_rad_s + steps * SPEED_STEP_RAD_S
        self.speed_rad_s = min(max(wanted, SPEED_STEP_RAD_S), SPEED_MOST_RAD_S)

    def action_release(self) -> None:
        """Give the robot back and go on watching."""
        self._session.release()

    def action_take(self) -> None:
        """Ask for the robot again."""
        self._session.take()

    def on_app_blur(self, _event: AppBlur) -> None:
        """Stop the wheels when the window is left: no key release would be heard there."""
        if self._drives:
            self._session.stop()


def _joined(rows: list[Row]) -> Text:
    return Text("\n").join(row.text for row in rows)
