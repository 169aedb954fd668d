"""Message views: the presentation of messages by schema. Pure.

A package names its views as entry points of the group ``scout_backbone.views``: tables of schema → class derived from
``MessageView``. A message of any other schema is shown as a table of its fields.
"""

from __future__ import annotations

import base64
import binascii
import logging
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import entry_points
from itertools import islice

import msgspec

from backbone.errors import complaint
from backbone.printable_text import printable
from backbone.spoken import counted

GROUP = "scout_backbone.views"
MOST_ROWS = 200  # chosen: several screens; a longer message needs its own view
MOST_ITEMS = 16  # chosen: of a longer list only the length is shown
LONGEST_TEXT = 160  # chosen: one line of a wide terminal

log = logging.getLogger(__name__)

Fields = Mapping[str, object]
"""Fields of a message by name, as in a recording: numbers, texts, lists, mappings; bytes as base64."""


class FieldRow(msgspec.Struct, frozen=True):
    """A row of a table.

    Attributes:
        name: Name of the field; a nested one is ``outer.inner``, an item of a list ``outer.0``.
        text: Its value, for people.
        number: Its value as a number, for a plot; None: not a number.
    """

    name: str
    text: str
    number: float | None = None


class PixelPicture(msgspec.Struct, frozen=True):
    """Pixels.

    Attributes:
        width_px: Columns.
        height_px: Rows.
        pixels: Row by row from the top: grey levels, or red, green and blue of each.
    """

    width_px: int
    height_px: int
    pixels: bytes

    @property
    def is_color(self) -> bool:
        """Whether each pixel has red, green and blue."""
        return len(self.pixels) == 3 * self.width_px * self.height_px


class MessageView:
    """Shows each field of a message in a row. Derive from it for another presentation of a schema."""

    def rows(self, fields: Fields) -> Sequence[FieldRow]:
        """Return the rows of the table; rows with a number can be plotted.

        When: for each message. Not: long computations, or state between messages.
        """
        return field_rows(fields)

    def picture(self, fields: Fields) -> PixelPicture | None:  # noqa: ARG002
        """Return the picture in the message; None: no picture."""
        return None


class PictureView(MessageView):
    """Shows a message of ``width_px``, ``height_px`` and ``pixels`` as a picture, and its other fields as rows."""

    def rows(self, fields: Fields) -> Sequence[FieldRow]:
        """Return all fields except the pixels."""
        return field_rows({name: value for name, value in fields.items() if name != "pixels"})

    def picture(self, fields: Fields) -> PixelPicture | None:
        """Return the picture; None: the number of pixels does not match the stated size."""
        try:
            pixels = base64.b64decode(str(fields["pixels"]), validate=True)
        except binascii.Error:
            return None
        width, height = int(str(fields["width_px"])), int(str(fields["height_px"]))
        is_whole = width > 0 and height > 0 and len(pixels) in (width * height, 3 * width * height)
        return PixelPicture(width, height, pixels) if is_whole else None


Views = Mapping[str, type[MessageView]]
VIEWS: Views = {"Frame/1": PictureView, "ViewPicture/1": PictureView}
"""The views of this package."""


@cache
def installed_views() -> Views:
    """Return the views of the installed packages, by schema; a package whose views cannot be loaded is left out.

    Another package's view replaces one of this project; of two others, that of the first by name counts.
    """
    found: dict[str, type[MessageView]] = {}
    of: dict[str, str] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            table = msgspec.convert(entry.load(), dict[str, type])
            if wrong := [schema for schema, kind in table.items() if not isinstance(kind(), MessageView)]:
                raise TypeError(f"the view of {wrong[0]} is not derived from MessageView")
            if bare := [schema for schema in table if not schema.partition("/")[2]]:
                raise ValueError(f"the schema {bare[0]} lacks its version: write {bare[0].rstrip('/')}/1")
            for schema, kind in table.items():
                if schema in of:
                    log.warning("%s has a view of %s, too; that of %s is shown", entry.name, schema, of[schema])
                elif VIEWS.get(schema) is not kind:
                    found[schema], of[schema] = kind, entry.name
        except (Exception, SystemExit) as error:  # a module that is being written raises anything
            log.warning("the views of %s are left out: %s", entry.name, complaint(error))
    return {**VIEWS, **found}


def field_rows(body: object) -> list[FieldRow]:
    """Return a row for each value in a message; at most ``MOST_ROWS``.

    Example:
        >>> [(row.name, row.text, row.number) for row in field_rows({"at": {"x_m": 1.5}, "on": True, "rcs": ["radio"]})]
        [('at.x_m', '1.5', 1.5), ('on', 'yes', 1.0), ('rcs.0', 'radio', None)]
    """
    return list(islice(_rows("", body), MOST_ROWS))


def _rows(name: str, value: object) -> Iterator[FieldRow]:
    match value:
        case Mapping() if value:
            for inner, each in islice(value.items(), MOST_ROWS):
                yield from _rows(f"{name}.{inner}" if name else str(inner), each)
        case list() if 0 < len(value) <= MOST_ITEMS:
            for number, each in enumerate(value):
                yield from _rows(f"{name}.{number}" if name else str(number), each)
        case _:
            yield _row(name, value)


def _row(name: str, value: object) -> FieldRow:
    shown = printable(name, LONGEST_TEXT)
    match value:
        case bool():
            return FieldRow(shown, "yes" if value else "no", float(value))
        case int() | float():
            text = f"{value:.6g}" if isinstance(value, float) else printable(str(value), LONGEST_TEXT)
            return FieldRow(shown, text, _as_number(value))
        case list():
            return FieldRow(shown, counted(len(value), "item"))
        case bytes():
            return FieldRow(shown, counted(len(value), "byte"))
        case None:
            return FieldRow(shown, "none")
        case _:
            return FieldRow(shown, printable(str(value), LONGEST_TEXT))


def _as_number(value: float) -> float | None:
    """Return the number as a float; None: the integer is too large to plot."""
    try:
        return float(value)
    except OverflowError:
        return None
