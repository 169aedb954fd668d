"""Key view: the newest message of one key, and plots of its numbers over time. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from backbone.errors import named
from backbone.printable_text import printable
from ui_console.model.message_views import LONGEST_TEXT, FieldRow, MessageView, PixelPicture, Views, field_rows
from ui_console.model.series import SPAN_S, Series

MOST_SERIES = 200  # chosen: the largest number of rows of a message


class KeyView:
    """View of the messages of one key and schema; its size is bounded for any number of messages.

    Args:
        views: Schema → its view.
        span_s: Time span of the plots, mission seconds.
    """

    def __init__(self, schema: str, views: Views, span_s: float = SPAN_S) -> None:
        self._view, self._span_s = views.get(schema, MessageView)(), span_s
        self._series: dict[str, Series] = {}
        self._newest: tuple[float, int] | None = None
        self.rows: Sequence[FieldRow] = ()
        """Of the newest message."""
        self.picture: PixelPicture | None = None
        """Of the newest message; None: it has none."""
        self.messages = 0
        """Number of messages so far."""
        self.trouble = ""
        """Why the message is shown only as a table of fields; empty: its own view shows it."""

    @property
    def at_s(self) -> float:
        """Mission time of the newest message; −1: no message yet."""
        return self._newest[0] if self._newest is not None else -1.0

    def take(self, body: object, at_s: float, sequence: int) -> None:
        """Show a message.

        Args:
            body: Its fields by name; if its class is not known, a list or bytes.
            at_s: Mission time of its sending.
            sequence: Number among the messages of its sender. If a player repeats the newest message, nothing changes.
        """
        if self._newest == (at_s, sequence):
            return
        self._newest = at_s, sequence
        self.messages += 1
        self.trouble = ""
        self.rows, self.picture = self._shown(body)
        for row in self.rows:
            if row.number is not None:
                self._series_of(row.name).add(at_s, row.number)

    def series(self, name: str) -> Series | None:
        """Return the numbers of a row over time; None: the row has no numbers."""
        return self._series.get(name)

    def _shown(self, body: object) -> tuple[Sequence[FieldRow], PixelPicture | None]:
        if isinstance(body, Mapping):
            try:
                rows = msgspec.convert(msgspec.to_builtins(self._view.rows(body)), list[FieldRow])
                return rows, msgspec.convert(self._view.picture(body), PixelPicture | None)
            except (Exception, SystemExit) as error:  # a view of another package raises anything
                why = f"{type(self._view).__name__} cannot show it: {named(error)}"
                self.trouble = printable(why, LONGEST_TEXT)
        return field_rows(body), None

    def _series_of(self, name: str) -> Series:
        """Return the row's series; if there are too many, a new series replaces the oldest one."""
        if name not in self._series:
            if len(self._series) >= MOST_SERIES:
                del self._series[next(iter(self._series))]
            self._series[name] = Series(self._span_s)
        return self._series[name]
