"""Debug views of behaviors, as rows for screens. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from backbone.debug_views import ViewEntry, ViewKind


class ViewRow(msgspec.Struct, frozen=True):
    """A debug view of a behavior.

    Attributes:
        view: Its name.
        is_picture: True: it shows pictures; False: values.
        text: The newest value for people; empty for pictures.
    """

    view: str
    is_picture: bool
    text: str = ""


class SeenViews(msgspec.Struct, frozen=True):
    """The debug views of the behavior that a page watches.

    Attributes:
        behavior: Its name; empty: no behavior is watched.
        views: The views shown so far, with their newest values.
        trouble: Why there are no views; empty: no trouble.
    """

    behavior: str = ""
    views: list[ViewRow] = []
    trouble: str = ""


def view_rows(entries: Sequence[ViewEntry]) -> list[ViewRow]:
    """Return a row for each view, in the same order."""
    return [
        ViewRow(one.view, True) if one.kind is ViewKind.PICTURE else ViewRow(one.view, False, shown_text(one.value))
        for one in entries
    ]


def shown_text(value: float | bool | str) -> str:
    """Return a value of a view for people.

    Example:
        >>> shown_text(28.0), shown_text(0.7300001), shown_text(True), shown_text("tracking")
        ('28', '0.73', 'yes', 'tracking')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:.6g}"
