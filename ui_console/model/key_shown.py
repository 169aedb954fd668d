"""What a page is shown of the messages on the bus: a list of keys, and one message. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import msgspec

from ui_console.model.key_table import KeyRow, with_words
from ui_console.model.message_views import FieldRow

MOST_LISTED = 100  # chosen: several screens; words find the others


class KeyOrder(StrEnum):
    """Orders of a list of keys."""

    KEY = "key"
    BYTES = "bytes"  # those with the most bytes in a second first


class KeyList(msgspec.Struct, frozen=True):
    """Keys that a page lists.

    Attributes:
        rows: At most ``MOST_LISTED``.
        matching: Number of rows with the words.
        heard: Number of all rows.
        dropped: Number of messages that came too fast to be counted.
    """

    rows: Sequence[KeyRow]
    matching: int
    heard: int
    dropped: int


class MessageShown(msgspec.Struct, frozen=True):
    """The newest message that a page looks at.

    Attributes:
        number: Of those that were shown; between two of them more may have come.
        stamp_s: Mission time of its sending.
        sequence: Its number among those of its sender.
        cause: Id of the message that led to it.
        size_bytes: Its length on the bus.
        rows: Its fields.
        trouble: Why it is shown in another way than messages of its kind are; empty: it is not.
        has_picture: True: a picture of it comes beside this.
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
    """Return the rows that have all of these words in key, sender or schema.

    Args:
        rows: In the order of keys.
        words: See ``with_words``.
        order: Of the result.
        dropped: Number of messages that came too fast to be counted.
    """
    found = with_words(rows, words)
    if order is KeyOrder.BYTES:
        found.sort(key=lambda row: -row.bytes_per_s)
    return KeyList(found[:MOST_LISTED], len(found), len(rows), dropped)
