"""Dialogs for messages on the bus: choose a key from the list with message rates, and watch its messages live."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import DataTable, Sparkline, Static
from textual.widgets.data_table import RowKey

from backbone.errors import LinkError, Refusal
from backbone.printable_text import printable_lines
from backbone.spoken import counted
from ui_console.model.key_table import KeyRow, with_words
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import PixelPicture
from ui_console.session.looking import pixels_of
from ui_console.terminal.dialogs import Dialog, Field, field_remark
from ui_console.terminal.widgets import Video

REDRAW_EACH_S = 0.3  # chosen: people read no faster
COLUMNS = ("key", "per s", "B/s", "mean B", "schema", "from")

KeepListing = Callable[[Callable[[list[KeyRow]], None]], Coroutine[object, None, None]]
KeepHearing = Callable[[KeyRow, Callable[[KeyView], None]], Coroutine[object, None, None]]


class KeyPicker(Dialog[KeyRow]):
    """Choose one of the keys with messages; the answer is its row. Typed words filter the list.

    Args:
        keep_listing: Calls its argument with the rows each second, until cancelled.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(key, f"cursor('{key}')", show=False) for key in ("up", "down", "pageup", "pagedown")
    ]

    def __init__(self, keep_listing: KeepListing) -> None:
        super().__init__()
        self._keep_listing = keep_listing
        self._heard: Sequence[KeyRow] = ()
        self._rows: dict[str, KeyRow] = {}

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        with Vertical() as box:
            box.border_title = "what is said (enter shows it)"
            field = Field(placeholder="words in key, sender or schema")
            field.cursor_blink = False
            yield field
            table = DataTable[Text](cursor_type="row")
            table.can_focus = False
            yield table
            yield Static("nothing was heard yet", id="trouble", classes="remark", markup=False)

    def on_mount(self) -> None:
        """Begin to listen."""
        for name in COLUMNS:
            self._table.add_column(name, key=name)
        self._list()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Answer, because a row was clicked."""
        self.answer(self._rows.get(event.row_key.value or ""))

    def on_input_submitted(self, _event: Field.Submitted) -> None:
        """Answer with the row under the cursor, if there is one."""
        here = self._here()
        if here is not None:
            self.answer(self._rows.get(here.value or ""))

    def on_input_changed(self, _event: Field.Changed) -> None:
        """List the keys that contain the words."""
        self._show(self._heard)

    def action_cursor(self, key: str) -> None:
        """Move the cursor of the table."""
        table = self._table
        moves = {
            "up": table.action_cursor_up,
            "down": table.action_cursor_down,
            "pageup": table.action_page_up,
            "pagedown": table.action_page_down,
        }
        moves[key]()

    @property
    def _table(self) -> DataTable[Text]:
        return self.query_one(DataTable)

    @work
    async def _list(self) -> None:
        try:
            await self._keep_listing(self._show)
        except (Refusal, LinkError) as error:
            self.query_one("#trouble", Static).update(printable_lines(str(error)))

    def _show(self, rows: Sequence[KeyRow]) -> None:
        if not self.is_mounted:
            return
        self._heard = rows
        table, here = self._table, self._here()
        shown = {"\n".join(row.id): row for row in with_words(rows, self.query_one(Field).value)}
        for gone in self._rows.keys() - shown.keys():
            table.remove_row(gone)
        has_new = shown.keys() - self._rows.keys()
        for name, row in shown.items():
            self._show_row(table, name, row)
        self._rows = shown
        if has_new:
            table.sort("key", "from", "schema", key=lambda cells: [cell.plain for cell in cells])
            _return_to(table, here)
        count = counted(len(rows), "row")
        told = f"{len(shown)} of {count}" if len(shown) < len(rows) else count
        remark = "; ".join(filter(None, (told, field_remark(self.app)))) if rows else "nothing was heard yet"
        self.query_one("#trouble", Static).update(remark)

    def _here(self) -> RowKey | None:
        """Return the key of the row under the cursor; None: no row."""
        table = self._table
        return table.coordinate_to_cell_key(table.cursor_coordinate).row_key if table.row_count else None

    def _show_row(self, table: DataTable[Text], name: str, row: KeyRow) -> None:
        if name not in self._rows:
            table.add_row(*map(Text, ("", "", "", "", "", "")), key=name)
            for column, text in (("key", row.key), ("schema", row.schema or "no message"), ("from", _sender(row))):
                table.update_cell(name, column, Text(text), update_width=True)
        numbers = (f"{row.messages_per_s:.2f}", f"{row.bytes_per_s:.0f}", f"{row.mean_bytes:.0f}")
        for column, text in zip(COLUMNS[1:4], numbers, strict=True):
            table.update_cell(name, column, Text(text, justify="right"), update_width=True)


class KeyDialog(Dialog[None]):
    """The messages of one key: fields, a plot of the number under the cursor, and a picture.

    Args:
        keep_hearing: Calls its argument with the view at each begin, until cancelled.
        now_s: Returns the mission time.
        has_pixels: True if the terminal shows real pixels, and no other picture is on the screen.
    """

    def __init__(
        self, row: KeyRow, keep_hearing: KeepHearing, now_s: Callable[[], float], *, has_pixels: bool = False
    ) -> None:
        super().__init__()
        self._row, self._keep_hearing, self._now_s, self._has_pixels = row, keep_hearing, now_s, has_pixels
        self._view: KeyView | None = None
        self._names: list[str] = []
        self._seen: tuple[KeyView | None, int] = (None, 0)
        self._drawn: tuple[PixelPicture | None, NDArray[np.uint8] | None] = (None, None)

    def compose(self) -> ComposeResult:
        """Lay out: a line, the picture, the plot, the fields."""
        with Vertical() as box:
            box.border_title = Text(f"{self._row.key} (escape leaves)")
            yield Static("nothing was said yet", id="key-line", markup=False)
            yield Video(self._pixels, has_pixels=self._has_pixels)
            with Horizontal(id="plot-room"):
                yield Sparkline(id="plot")
            yield Static(id="plot-line", classes="remark", markup=False)
            yield DataTable[Text](cursor_type="row", show_header=False)

    def on_mount(self) -> None:
        """Begin to listen."""
        self._table.add_columns("field", "value")
        for shown in ("#video", "#plot-room", "#plot-line"):
            self.query_one(shown).display = False
        self.set_interval(REDRAW_EACH_S, self._redraw)
        self._hear()

    def on_data_table_row_highlighted(self, _event: DataTable.RowHighlighted) -> None:
        """Plot the number under the cursor."""
        self._redraw_plot()

    @property
    def _table(self) -> DataTable[Text]:
        return self.query_one(DataTable)

    @work
    async def _hear(self) -> None:
        try:
            await self._keep_hearing(self._row, self._begin)
        except (Refusal, LinkError) as error:
            self._view = None
            self.query_one("#key-line", Static).update(printable_lines(str(error)))

    def _begin(self, view: KeyView) -> None:
        self._view = view
        self._redraw()

    def _redraw(self) -> None:
        view = self._view
        if view is None or not self.is_mounted:
            return
        self.query_one("#key-line", Static).update(self._line(view))
        if (view, view.messages) != self._seen:
            self._seen = (view, view.messages)
            self._redraw_fields(view)
            video = self.query_one(Video)
            video.display = view.picture is not None
            self.call_after_refresh(video.look)
        self._redraw_plot()

    def _line(self, view: KeyView) -> str:
        sender = _sender(self._row)
        what = f"{self._row.schema or 'no message'}{f' from {sender}' if sender else ''}"
        if not view.messages:
            return f"{what}: nothing was said yet"
        age_s = max(0.0, self._now_s() - view.at_s)
        said = f"{what}: {counted(view.messages, 'message')}, the last {age_s:.1f} s ago"
        return f"{said}\n{view.trouble}" if view.trouble else said

    def _redraw_fields(self, view: KeyView) -> None:
        table, names = self._table, [row.name for row in view.rows]
        if names != self._names:
            begins, here = not self._names, table.cursor_row
            table.clear()
            for number, row in enumerate(view.rows):
                table.add_row(Text(row.name, "bold"), Text(row.text), key=str(number))
            self._names = names
            first = next((number for number, row in enumerate(view.rows) if row.number is not None), 0)
            table.move_cursor(row=first if begins else here)
            return
        value = list(table.columns)[1]
        for number, row in enumerate(view.rows):
            table.update_cell(str(number), value, Text(row.text), update_width=True)

    def _redraw_plot(self) -> None:
        view, here = self._view, self._table.cursor_row
        name = self._names[here] if here < len(self._names) else ""
        series = view.series(name) if view is not None else None
        extent = series.extent(self._now_s()) if series is not None else None
        room, line = self.query_one("#plot-room"), self.query_one("#plot-line", Static)
        room.display = line.display = extent is not None
        if series is None or extent is None:
            return
        levels = series.levels(self._now_s(), max(1, room.size.width))
        plot = self.query_one(Sparkline)
        plot.styles.width, plot.data = max(1, len(levels)), levels
        line.update(f"{name}: {extent.least:.6g} to {extent.most:.6g} in the last {series.span_s:.0f} s")

    def _pixels(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, the same array for the same picture."""
        picture = self._view.picture if self._view is not None else None
        if picture is not self._drawn[0]:
            self._drawn = picture, pixels_of(picture) if picture is not None else None
        return self._drawn[1]


def _sender(row: KeyRow) -> str:
    """Return the sender, unless it is the component of the key."""
    return "" if row.key.startswith(f"{row.source}/") else row.source


def _return_to(table: DataTable[Text], row: RowKey | None) -> None:
    """Move the cursor to the row on which it was, even if the row has moved."""
    if row is not None and row in table.rows:
        table.move_cursor(row=table.get_row_index(row))
