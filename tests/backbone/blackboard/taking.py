"""Taking values from boards, with a time limit."""

from __future__ import annotations

from collections.abc import Callable

from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.values import MOST_IN_PACKET, Value

WITHIN_S = 10.0
SIZES = [0, 1, MOST_IN_PACKET, MOST_IN_PACKET + 1, 1_000_000]
Count = Callable[[], int]


def taken(reader: BlackboardReader) -> Value:
    value = reader.newest()
    assert value is not None
    return value
