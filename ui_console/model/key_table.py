"""Keys of a mission with the rate and size of what is said at them, as ``scout-backbone top`` tells them. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec

from backbone.command_line.message_lines import short_key
from backbone.printable_text import printable

PART_S, PARTS = 0.5, 10  # chosen: a rate over five seconds is steady enough to read, and forgets soon
MOST_KEYS = 2000  # chosen: ten times those of a mission of ten robots


class KeyRow(msgspec.Struct, frozen=True):
    """One key, with one sender and one schema.

    Attributes:
        key: Without ``scout/<mission>/``.
        source: Address of the sender; empty: the bytes are no message.
        schema: ``<Name>/<version>``; empty: the bytes are no message.
        messages_per_s: Over the last seconds.
        bytes_per_s: Same.
        mean_bytes: Of all messages so far; 0: none was heard.
        heard_s: Mission time of the last one; −1: none was heard.
    """

    key: str
    source: str
    schema: str
    messages_per_s: float = 0.0
    bytes_per_s: float = 0.0
    mean_bytes: float = 0.0
    heard_s: float = -1.0

    @property
    def id(self) -> tuple[str, str, str]:
        """Key, sender and schema."""
        return self.key, self.source, self.schema


@dataclass(slots=True)
class _Counts:
    """What was heard of one row; ``parts`` are number of the part of time, messages and bytes in it."""

    since_s: float
    messages: int = 0
    size_bytes: int = 0
    heard_s: float = -1.0
    parts: deque[tuple[int, int, int]] = field(default_factory=lambda: deque(maxlen=PARTS))


class KeyTable:
    """Counts what is heard; its size is bounded however many keys and messages there are.

    Args:
        since_s: Mission time since when everything is heard.
        known: Key, sender and schema of rows that are shown even if nothing is heard of them.
    """

    def __init__(self, since_s: float, known: Iterable[tuple[str, str, str]] = ()) -> None:
        self._since_s = since_s
        self._rows = {
            (short_key(key), source, schema): _Counts(since_s) for key, source, schema in list(known)[:MOST_KEYS]
        }

    def add(self, key: str, source: str, schema: str, size_bytes: int, at_s: float) -> None:
        """Count one message.

        Args:
            key: With ``scout/<mission>/``.
            source: Address of the sender.
            schema: Of the message.
            size_bytes: Its length.
            at_s: Mission time when it was heard.
        """
        name = (short_key(key), source, schema)
        counts = self._rows.get(name)
        if counts is None:
            self._make_room()
            counts = self._rows[name] = _Counts(self._since_s)
        number = int(at_s / PART_S)
        _last, messages, size = counts.parts.pop() if _is_last(counts, number) else (number, 0, 0)
        counts.parts.append((number, messages + 1, size + size_bytes))
        counts.messages, counts.size_bytes = counts.messages + 1, counts.size_bytes + size_bytes
        counts.heard_s = at_s

    def rows(self, now_s: float, rate: float = 1.0) -> list[KeyRow]:
        """Return all rows in the order of keys.

        Args:
            now_s: Mission time.
            rate: Mission seconds in one of those in which rates are told.
        """
        return [_row(name, counts, now_s, rate) for name, counts in sorted(self._rows.items())]

    def _make_room(self) -> None:
        while len(self._rows) >= MOST_KEYS:
            del self._rows[min(self._rows, key=lambda name: self._rows[name].heard_s)]


def with_words(rows: Iterable[KeyRow], words: str) -> list[KeyRow]:
    """Return the rows that have all of these words in key, sender or schema; case does not matter.

    Example:
        >>> rows = [KeyRow("resource_pool/eye/frames", "resource_pool/eye", "Frame/1"), KeyRow("a/b/log", "a/b", "")]
        >>> [row.key for row in with_words(rows, "eye FRAME")]
        ['resource_pool/eye/frames']
    """
    wanted = words.casefold().split()
    return [row for row in rows if all(word in " ".join(row.id).casefold() for word in wanted)]


def _is_last(counts: _Counts, number: int) -> bool:
    """Return whether this part of time is the last that was counted, as it stays if time falls."""
    return bool(counts.parts) and number <= counts.parts[-1][0]


def _row(name: tuple[str, str, str], counts: _Counts, now_s: float, rate: float) -> KeyRow:
    oldest = int(now_s / PART_S) - PARTS + 1
    recent = [(messages, size) for number, messages, size in counts.parts if number >= oldest]
    lasted_s = max(PART_S, now_s - max(counts.since_s, oldest * PART_S)) / rate
    key, source, schema = map(printable, name)
    return KeyRow(
        key,
        source,
        schema,
        messages_per_s=sum(messages for messages, _size in recent) / lasted_s,
        bytes_per_s=sum(size for _messages, size in recent) / lasted_s,
        mean_bytes=counts.size_bytes / counts.messages if counts.messages else 0.0,
        heard_s=counts.heard_s,
    )
