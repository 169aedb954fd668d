"""Keys of a mission with the rate and size of their messages, as in ``scout-backbone top``. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec

from backbone.command_line.message_lines import short_key
from backbone.printable_text import printable

PART_S, PARTS = 0.5, 10  # chosen: a rate over five seconds is steady enough to read, and follows changes soon
MOST_KEYS = 2000  # chosen: ten times the keys of a mission with ten robots


class KeyRow(msgspec.Struct, frozen=True):
    """A key with one sender and one schema.

    Attributes:
        key: Without ``scout/<mission>/``.
        source: Address of the sender; empty: the bytes are no message.
        schema: ``<Name>/<version>``; empty: the bytes are no message.
        messages_per_s: Rate over the last seconds.
        bytes_per_s: Same.
        mean_bytes: Mean size of all messages so far; 0: no message yet.
        heard_s: Mission time of the last message; −1: no message yet.
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
    """Counts of one row; each of ``parts`` is a time slot's number with the messages and bytes in it."""

    since_s: float
    messages: int = 0
    size_bytes: int = 0
    heard_s: float = -1.0
    parts: deque[tuple[int, int, int]] = field(default_factory=lambda: deque(maxlen=PARTS))


class KeyTable:
    """Counts messages; its size is bounded for any number of keys and messages.

    Args:
        since_s: Mission time from which all messages are received.
        known: Key, sender and schema of rows that are shown even without messages.
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
            size_bytes: Its length.
            at_s: Mission time of its arrival.
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
            rate: Mission seconds per second of the shown rates.
        """
        return [_row(name, counts, now_s, rate) for name, counts in sorted(self._rows.items())]

    def _make_room(self) -> None:
        while len(self._rows) >= MOST_KEYS:
            del self._rows[min(self._rows, key=lambda name: self._rows[name].heard_s)]


def with_words(rows: Iterable[KeyRow], words: str) -> list[KeyRow]:
    """Return the rows that contain all of these words in key, sender or schema, ignoring case.

    Example:
        >>> rows = [KeyRow("resource_pool/eye/frames", "resource_pool/eye", "Frame/1"), KeyRow("a/b/log", "a/b", "")]
        >>> [row.key for row in with_words(rows, "eye FRAME")]
        ['resource_pool/eye/frames']
    """
    wanted = words.casefold().split()
    return [row for row in rows if all(word in " ".join(row.id).casefold() for word in wanted)]


def _is_last(counts: _Counts, number: int) -> bool:
    """Return whether this time slot is the last counted one; it stays the last if time goes back."""
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
