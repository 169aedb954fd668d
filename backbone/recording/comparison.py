"""Comparison of two recordings, key by key: the first difference, and the errors of numbers. Pure.

The n-th message of a key, sender and schema in one recording is compared with the n-th in the other. The fields of a
message count, its time of sending does not.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import zip_longest
from typing import Any

from backbone.recording.reader import KeyCount, Recorded

Named = tuple[str, str, str]
"""Key without ``scout/<mission>/``, sender, schema."""


class Absent(StrEnum):
    """Replaces a value that one recording lacks. Null is a value, such as of a number that was NaN."""

    ABSENT = "absent"


ABSENT = Absent.ABSENT


@dataclass(slots=True)
class NumberError:
    """The distances between the values of one number in the two recordings.

    Attributes:
        largest: Largest distance.
        root: Square root of the sum of the squares of all distances.
        count: Number of compared pairs.
    """

    largest: float = 0.0
    root: float = 0.0
    count: int = 0

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances."""
        return self.root / math.sqrt(self.count) if self.count else 0.0

    def add(self, distance: float) -> None:
        """Count one pair of numbers."""
        self.largest = max(self.largest, distance)
        self.root = math.hypot(self.root, distance)  # the squares themselves may be too large for a number
        self.count += 1


@dataclass(frozen=True, slots=True)
class Difference:
    """The first pair of messages that differ by more than the tolerance.

    Attributes:
        number: Number of the message, from 0.
        first_s: Its mission time in the first recording.
        second_s: Its mission time in the second.
        field: Path of the first field that differs, as ``rcs.0.rc``.
        first: Value of the field in the first recording, or ``ABSENT``.
        second: Value of the field in the second, or ``ABSENT``.
    """

    number: int
    first_s: float
    second_s: float
    field: str
    first: Any
    second: Any


@dataclass(slots=True)
class KeyComparison:
    """The messages of one key, sender and schema.

    Attributes:
        first: Number of messages in the first recording.
        second: Number of messages in the second.
        differing: Pairs that differ by more than the tolerance.
        difference: The first of these; None: there is none.
        errors: Path of a number → its distances; positions in lists are ``*``. Contains only numbers that differ.
    """

    first: int = 0
    second: int = 0
    differing: int = 0
    difference: Difference | None = None
    errors: dict[str, NumberError] = field(default_factory=lambda: defaultdict(NumberError))

    @property
    def is_same(self) -> bool:
        """Whether both have the same number of messages, and no pair differs by more than the tolerance."""
        return self.first == self.second and not self.differing


def compared(
    first: Iterable[Recorded],
    second: Iterable[Recorded],
    tolerances: Mapping[str, float] | None = None,
    pairs: Mapping[Named, int] | None = None,
) -> dict[Named, KeyComparison]:
    """Return the comparison of each key, sender and schema.

    Args:
        first: Messages of one recording, in their order.
        second: Messages of the other, in their order.
        tolerances: Name or path of a field → largest distance of its numbers that counts as equal.
        pairs: See ``pairs_in``; None: not known, and a message without partner stays in memory.
    """
    allowed = tolerances or {}
    found: dict[Named, KeyComparison] = defaultdict(KeyComparison)
    waiting: dict[Named, tuple[deque[Recorded], deque[Recorded]]] = defaultdict(lambda: (deque(), deque()))
    for pair in zip_longest(first, second):
        for side, message in enumerate(pair):
            if message is None:
                continue
            named = _named(message)
            if side:
                found[named].second += 1
            else:
                found[named].first += 1
            number = found[named].second if side else found[named].first
            if pairs is not None and number > pairs.get(named, number):
                continue
            firsts, seconds = waiting[named]
            waiting[named][side].append(message)
            if firsts and seconds:
                _compare(found[named], firsts.popleft(), seconds.popleft(), allowed)
    return dict(sorted(found.items()))


def pairs_in(first: Iterable[KeyCount], second: Iterable[KeyCount]) -> dict[Named, int] | None:
    """Return the number of pairs of each key, sender and schema, by the indexes of two recordings.

    Returns:
        The smaller of both numbers, except of messages without a schema: some of those have one in the index, see
        ``Recorded.schema``. None: a recording has so many keys that its index does not name all.
    """
    numbers = (Counter[Named](), Counter[Named]())
    for number, counts in zip(numbers, (first, second), strict=True):
        for count in counts:
            if not count.key:
                return None
            number[_named(count)] += count.messages
    one, other = numbers
    return {named: min(one[named], other[named]) for named in one | other if named[2]}


def _named(one: Recorded | KeyCount) -> Named:
    return one.key.split("/", 2)[-1], one.source, one.schema


def _compare(found: KeyComparison, first: Recorded, second: Recorded, tolerances: Mapping[str, float]) -> None:
    number = min(found.first, found.second) - 1
    differs = False
    for path, one, other in _unequal(first.body, second.body, ""):
        if _is_number(one) and _is_number(other):
            distance = abs(one - other)
            found.errors[_general(path)].add(distance)
            if distance <= tolerances.get(path, tolerances.get(path.rpartition(".")[2], 0.0)):
                continue
        if not differs and found.difference is None:
            found.difference = Difference(number, first.at_s, second.at_s, path, one, other)
        differs = True
    found.differing += differs


def _unequal(first: Any, second: Any, path: str) -> Iterator[tuple[str, Any, Any]]:
    """Yield the paths at which two bodies differ, with both values."""
    if isinstance(first, dict) and isinstance(second, dict):
        for name in dict.fromkeys((*first, *second)):
            inner = f"{path}.{name}" if path else name
            yield from _unequal(first.get(name, ABSENT), second.get(name, ABSENT), inner)
    elif isinstance(first, list) and isinstance(second, list):
        for place, (one, other) in enumerate(zip_longest(first, second, fillvalue=ABSENT)):
            yield from _unequal(one, other, f"{path}.{place}" if path else str(place))
    elif first != second or isinstance(first, bool) is not isinstance(second, bool):  # True equals 1
        yield path, first, second


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _general(path: str) -> str:
    return ".".join("*" if part.isdecimal() else part for part in path.split("."))
