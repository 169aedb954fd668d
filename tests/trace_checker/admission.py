"""Exact response times of streams on a sharable RC that sends packets one after the other.

A stream is (period, cost, deadline, jitter, priority, name) in whole microseconds, ordered by priority
(larger first), then shorter period, then name. Nothing interrupts a packet that is being sent.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

MICROSECONDS = 1e6
LONGEST_BUSY_PERIODS = 10_000  # chosen: a radio that is busy for so many of its longest periods is busy for ever
ROUNDING = 1e-9  # chosen: shares that add up to the capacity fit, whatever the last bit of their sum


class Stream(NamedTuple):
    """Times in microseconds."""

    period: int
    cost: int
    deadline: int
    jitter: int


def microseconds(seconds: float) -> int:
    return round(seconds * MICROSECONDS)


def stream_of(field: dict[str, Any]) -> Stream:
    """Return the stream of an entry in a request's ``use``."""
    period = microseconds(field["period"])
    deadline = microseconds(field["deadline"]) if field.get("deadline") else period
    return Stream(period, microseconds(field["cost"]), deadline, microseconds(field.get("jitter") or 0.0))


def utilization(streams: Sequence[Stream]) -> float:
    return sum(one.cost / one.period for one in streams)


def within_capacity(streams: Sequence[Stream], capacity: float) -> bool:
    return utilization(streams) <= capacity + ROUNDING


def admissible(streams: Sequence[Stream], capacity: float) -> bool:
    """Return whether the streams fit into the capacity and each meets its deadlines; highest first."""
    return within_capacity(streams, capacity) and all_in_time(tuple(streams))


@functools.lru_cache(maxsize=100_000)
def all_in_time(streams: tuple[Stream, ...]) -> bool:
    return all(_in_time(streams, place) for place in range(len(streams)))


def _in_time(streams: tuple[Stream, ...], place: int) -> bool:
    """Return whether each packet of this stream in the longest busy period is through by its deadline."""
    me, above, below = streams[place], streams[:place], streams[place + 1 :]
    blocking = max((one.cost - 1 for one in below), default=0)
    busy = _busy_period(streams[: place + 1], blocking)
    if busy is None:
        return False
    begin = 0
    for packet in range(-(-(busy + me.jitter) // me.period)):
        found = _begin(me, above, blocking, packet, begin)
        if found is None:
            return False
        begin = found
    return True


def _begin(me: Stream, above: tuple[Stream, ...], blocking: int, packet: int, begin: int) -> int | None:
    """Return when this packet begins to be sent, or nothing if it is late; ``begin``: of the packet before it."""
    own = blocking + packet * me.cost
    begin = max(begin, own)
    latest = me.deadline - me.jitter + packet * me.period - me.cost
    while begin <= latest:
        later = own
        for one in above:
            later += ((begin + one.jitter) // one.period + 1) * one.cost
        if later <= begin:
            return begin
        begin = later
    return None


def _busy_period(streams: tuple[Stream, ...], blocking: int) -> int | None:
    """Return how long the RC can have one of these packets to send without a pause, or nothing if without end."""
    length, longest = blocking + 1, LONGEST_BUSY_PERIODS * max(one.period for one in streams)
    while length <= longest:
        later = blocking + sum(-(-(length + one.jitter) // one.period) * one.cost for one in streams)
        if later <= length:
            return length
        length = later
    return None
