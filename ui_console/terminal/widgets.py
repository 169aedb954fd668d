"""Widgets of the terminal console; other files provide their content."""

from __future__ import annotations

import asyncio
import textwrap
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.timer import Timer
from textual.widget import Widget
from textual.widgets import Static

from backbone.spoken import counted
from ui_console.terminal.keys import Hint, key_lines
from ui_console.terminal.lines import Row, in_view, laid_out
from ui_console.terminal.pixels import MOST_ROWS, row_of_cells, send
from ui_console.terminal.video import fit, row_segments, shrink

SAY_EVERY_S = 0.1  # chosen: a third of ``STICK_LASTS_S``
ANSWERED_WITHIN_S = 1.0  # chosen: as for pictures, by which nobody must drive when they are older
MOST_DRAWN = (160, 60)  # columns and rows; measured: a noisy picture of 320 x 120 keeps a key waiting for 1 to 2 s
CURSOR = Style(reverse=True)
OLD = Style(bold=True, color="white", bgcolor="red")


class Video(Widget):
    """The newest picture, as large as fits; an old one is dark and has a remark, for it must not look alive.

    Args:
        newest: Returns the newest picture, as ``video.shrink`` takes it, or None.
        has_pixels: True if the terminal shows real pixels.
    """

    def __init__(self, newest: Callable[[], NDArray[np.uint8] | None], *, has_pixels: bool = False) -> None:
        super().__init__(id="video")
        self._newest, self._has_pixels = newest, has_pixels
        self._shown: NDArray[np.uint8] | None = None
        self._steps: NDArray[np.uint8] | None = None
        self._remark = ""

    def look(self, remark: str = "") -> None:
        """Show the newest picture; redraw if anything changed.

        Args:
            remark: Why the operator must not drive by this picture; empty: driving is possible.
        """
        picture = self._newest()
        if self.size.width == 0 or self.size.height == 0:
            return
        if picture is None:
            if self._shown is not None or remark != self._remark:
                self._shown, self._steps, self._remark = None, None, remark
                self.refresh()
            return
        columns, rows = self._cells(picture)
        fits = self._steps is not None and self._steps.shape[:2] == (2 * rows, columns)
        if picture is self._shown and fits and remark == self._remark:
            return
        self._shown, self._remark = picture, remark
        steps = shrink(picture, columns, rows)
        self._steps = steps // 3 if remark else steps
        self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return one row of cells."""
        width, blank = self.size.width, self.rich_style  # Textual's filter for NO_COLOR needs a style everywhere
        remark = textwrap.wrap(self._remark, max(1, width))
        row = y - self.size.height // 2 + len(remark) // 2
        if 0 <= row < len(remark):
            return Strip([Segment(remark[row].center(width), blank + OLD)]).crop(0, width)
        if self._steps is None or self._shown is None or 2 * y >= len(self._steps):
            return Strip.blank(width, blank)
        if not self._has_pixels or self._remark:
            return Strip(row_segments(self._steps, y)).adjust_cell_length(width, blank)
        rows, columns = len(self._steps) // 2, self._steps.shape[1]
        cells = Strip([row_of_cells(y, columns)], columns).adjust_cell_length(width, blank)
        return Strip([send(self._shown, columns, rows), *cells], self.size.width) if y == 0 else cells

    def _cells(self, picture: NDArray[np.uint8]) -> tuple[int, int]:
        width, height = self.size
        room = (width, MOST_ROWS) if self._has_pixels else MOST_DRAWN
        return fit(picture.shape[1], picture.shape[0], min(width, room[0]), min(height, room[1]))


class Panel(Static):
    """Rows with a cursor.

    Args:
        name: Its title, and its id.
    """

    def __init__(self, name: str) -> None:
        super().__init__(id=name, classes="panel")
        self.border_title = name
        self._rows: Sequence[Row] = ()
        self._key = ""
        self._is_chosen = False
        self._nothing = ""
        self._drawn: Text | None = None

    @property
    def row(self) -> Row | None:
        """The row under the cursor: until it was moved, or if its row has gone, the operator's own, else the first."""
        own = next((row for row in self._rows if row.is_own), None)
        return self.placed or own or (self._rows[0] if self._rows else None)

    @property
    def placed(self) -> Row | None:
        """The row to which the cursor was moved; None: it was not moved, or that row has gone."""
        return next((row for row in self._rows if row.key == self._key), None)

    def show_rows(self, rows: Sequence[Row], *, is_chosen: bool, nothing: str) -> None:
        """Show these rows; the cursor stays on its row, if the row still exists.

        Args:
            rows: From top to bottom.
            is_chosen: True: the keys for rows apply to this panel.
            nothing: Text if there are no rows.
        """
        self._rows, self._is_chosen, self._nothing = rows, is_chosen, nothing
        self._draw()

    def move(self, steps: int) -> None:
        """Move the cursor down, or up for negative steps, within the rows."""
        if self.row is None:
            return
        at = self._rows.index(self.row)
        self._key = self._rows[min(max(0, at + steps), len(self._rows) - 1)].key
        self._draw()

    def _draw(self) -> None:
        here, room = self.row, self._room()
        key = here.key if self._is_chosen and here is not None else None
        rows = laid_out(self._rows, key, self.content_size.width, room)
        for row, its_lines in zip(self._rows, rows, strict=True):
            if row.key == key:
                its_lines[0].stylize(CURSOR)
        is_cut = sum(map(len, rows)) > room
        self.border_subtitle = f"{counted(len(rows), 'row')}: pgup, pgdn" if is_cut else ""
        lines = in_view(self._rows, rows, key, room)
        self._put(Text("\n").join(lines) if rows else Text(self._nothing, style="dim"))

    def _put(self, drawn: Text) -> None:
        before, self._drawn = self._drawn, drawn
        if before is None or drawn != before or drawn.spans != before.spans:
            grew = before is None or drawn.plain.count("\n") != before.plain.count("\n")
            self.update(drawn, layout=grew)

    def _room(self) -> int:
        """Return the number of lines: its largest height, or its present one."""
        most = self.styles.max_height
        lines = int(most.value) - self.gutter.height if most is not None else self.content_size.height
        return max(1, lines)


class KeyLine(Static):
    """The relevant keys, as many as fit; a click on a key has the same effect as the key."""

    def show(self, found: Sequence[Hint], *, rows: int) -> None:
        """Show these keys in this number of lines."""
        self.update(key_lines(found, self.size.width, rows))


class DrivePad(Widget):
    """A square for dragging with the mouse: up is faster, sideways turns; releasing stops the wheels.

    The only control of a terminal that reports its release, apart from a gamepad.

    Law: the pad lets go if the terminal shows no sign of life for ``ANSWERED_WITHIN_S``, neither by the mouse nor by
    ``answered``. The release of a terminal that is cut off would never arrive.
    """

    class Dragged(Message):
        """The pad is being dragged; repeated every ``SAY_EVERY_S``, to be answered by ``answered``.

        Attributes:
            forward: −1 to 1, as of a stick.
            right: −1 to 1.
        """

        def __init__(self, forward: float, right: float) -> None:
            super().__init__()
            self.forward, self.right = forward, right

    class Released(Message):
        """The pad was released."""

    class Unanswered(Message):
        """The pad let go, because the terminal showed no sign of life."""

    def __init__(self) -> None:
        super().__init__(id="pad")
        self._at: tuple[float, float] | None = None
        self._answered_s = 0.0
        self._saying: Timer | None = None
        self.border_title = "drag to drive"

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Begin to drive, and repeat the command while the pad is held."""
        self.capture_mouse()
        self._drag(event)
        if self._saying is None:
            self._saying = self.set_interval(SAY_EVERY_S, self._say)

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Change the command."""
        if self._at is not None:
            self._drag(event)

    def on_mouse_up(self, _event: events.MouseUp) -> None:
        """Stop."""
        self.release_mouse()
        self._let_go()

    def on_mouse_release(self, _event: events.MouseRelease) -> None:
        """Stop, because another widget or window captured the mouse."""
        self._let_go()

    def let_go(self) -> None:
        """Stop, because the release of the mouse would not arrive: the window lost the focus, or does not answer."""
        self.release_mouse()
        self._let_go()

    def answered(self) -> None:
        """Record that the terminal answers, so the release of the mouse would arrive."""
        self._answered_s = asyncio.get_running_loop().time()

    def render_line(self, y: int) -> Strip:
        """Return one row: a cross, and the position of the pointer."""
        width, height = self.size.width, self.size.height
        cells = ["│" if column == width // 2 else "─" if y == height // 2 else " " for column in range(width)]
        if self._at is not None:
            forward, right = self._at
            row = round((1 - forward) / 2 * (height - 1))
            column = round((1 + right) / 2 * (width - 1))
            if y == row:
                cells[column] = "●"
        return Strip([Segment("".join(cells), self.rich_style)], width)

    def _drag(self, event: events.MouseEvent) -> None:
        half_width, half_height = max(1, self.size.width - 1) / 2, max(1, self.size.height - 1) / 2
        forward = min(max(1 - event.y / half_height, -1.0), 1.0)
        right = min(max(event.x / half_width - 1, -1.0), 1.0)
        self._at = forward, right
        self.answered()
        self.refresh()
        self._say()

    def _say(self) -> None:
        if self._at is None:
            return
        if asyncio.get_running_loop().time() > self._answered_s + ANSWERED_WITHIN_S:
            self.let_go()
            self.post_message(self.Unanswered())
        else:
            self.post_message(self.Dragged(*self._at))

    def _let_go(self) -> None:
        if self._saying is not None:
            self._saying.stop()
            self._saying = None
        if self._at is not None:
            self._at = None
            self.refresh()
            self.post_message(self.Released())
