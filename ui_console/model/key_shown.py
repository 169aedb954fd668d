"""Views of messages on the bus for a page: a list of keys, and one message. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import msgspec

from ui_console.model.key_table import KeyRow, with_words
from ui_console.model.message_views import FieldRow

MOST_LISTED = 100  # chosen: several screens; a search finds the others


class KeyOrder(StrEnum):
    """Orders of a list of keys."""

    KEY = "key"
    BYTES = "bytes"  # largest byte rate first


class KeyList(msgspec.Struct, frozen=True):
    """A list of keys for a page.

    Attributes:
        rows: At most ``MOST_LISTED``.
        matching: Number of rows that match the search words.
        heard: Number of all rows.
        dropped: Number of messages that came too fast to be counted.
    """

    rows: Sequence[KeyRow]
    matching: int
    heard: int
    dropped: int


class MessageShown(msgspec.Struct, frozen=True):
    """The newest message of the key that a page watches.

    Attributes:
        number: Number among the shown messages; messages in between may be skipped.
        stamp_s: Mission time of its sending.
        sequence: Its number among the messages of its sender.
        cause: Id of the message that caused it.
        size_bytes: Its length on the bus.
        rows: Its fields.
        trouble: Why its own view cannot show it; empty: no trouble.
        has_picture: True: its picture is sent separately.
    """

    number: int
    stamp_s: float
    sequence: int
    cause: str
    size_bytes: int
    rows: Sequence[FieldRow]
    trouble: str
    has_picture: bool


def key_list(rows: Sequence[KeyRow], words: str, order: KeyOrder, dropped: int) -> KeyList:
    """Return the rows that contain all of these words in key, sender or schema.

    Args:
        rows: Rows in the order of keys.
        words: See ``with_words``.
        dropped: Number of messages that came too fast to be counted.
    """
    found = with_words(rows, words)
    if order is KeyOrder.BYTES:
        found.sort(key=lambda row: -row.bytes_per_s)
    return KeyList(found[:MOST_LISTED], len(found), len(rows), dropped)
