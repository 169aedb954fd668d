"""A table that prints its rows as text where the terminal is too narrow for its columns."""

from __future__ import annotations

from collections.abc import Iterator

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.table import Column, Table
from rich.text import Text

_WRAPPED_LEAST = 12  # chosen: two short words; a column that wraps is still readable
_FRAME = 3  # a column's edge, and a blank at each of its sides
_INDENT = 2


class FittedTable(Table):
    """A table of texts; on a narrow terminal each row is its first cell, then the others after their columns' names.

    Example:
        >>> narrow = FittedTable("RC", "kind", "holder")
        >>> narrow.add_row("scout1", "scout", "")
        >>> Console(width=14).print(narrow)
        scout1
          kind scout
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table, or its rows as text."""
        if 1 + sum(_FRAME + _least_width(column) for column in self.columns) <= options.max_width:
            yield from super().__rich_console__(console, options)
        else:
            yield from self._as_text(console, options.max_width)

    def _as_text(self, console: Console, width: int) -> Iterator[Text]:
        if self.title:
            yield Text(str(self.title), style="bold")
        _, *names = (str(column.header) for column in self.columns)
        for first, *others in zip(*(column.cells for column in self.columns), strict=True):
            if _text(first):  # blank: the row belongs to the heading above
                yield _text(first)
            named = zip(names, map(_text, others), strict=True)
            line = Text(", ").join(Text.assemble((f"{name} ", "dim"), cell) for name, cell in named if cell)
            for part in line.wrap(console, max(1, width - _INDENT)):
                yield Text.assemble(" " * _INDENT, part)


def _least_width(column: Column) -> int:
    widest = max(cell_len(_text(cell).plain) for cell in (column.header, *column.cells))
    return widest if column.no_wrap else min(widest, _WRAPPED_LEAST)


def _text(cell: RenderableType) -> Text:
    return cell if isinstance(cell, Text) else Text(str(cell))
