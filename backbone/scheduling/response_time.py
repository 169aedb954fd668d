"""Response-time analysis: the streams that a sharable RC can serve together, each packet by its deadline.

A sharable RC sends one packet at a time and never interrupts it. Among waiting packets the one with the highest user
priority is sent first, then the one with the shorter period (rate monotonic), then the first by name. Response-time
analysis of every packet in the longest busy period decides exactly whether all deadlines hold. Analyzing only the first
packet is too optimistic for a non-preemptive server.

Rules of this file:

* Times are whole microseconds, so that no answer depends on rounding. Fractions appear only as bounds
  on a result, wide enough for their own rounding, that spare the exact search.
* A demand that cannot be analyzed within ``MAX_ROUNDS`` is refused: never optimistic.

The bounds: of n packets released every T with jitter J, at least (w + J)/T and at most 1 more fall into
a time w. So the beginning of the q-th packet lies between the solutions of two linear equations, and as
the load is at most 1 the upper bound of its response falls with q: if it is in time, so are all later packets.

Source: RAM 2002, "Sharable Resources"; Davis, Burns, Bril, Lukkien, "Controller Area Network (CAN)
schedulability analysis: refuted, revisited and revised", Real-Time Systems 35, 2007; Audsley, "Optimal
priority assignment and feasibility of static priority tasks with arbitrary start times", York 1991.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Literal

from backbone.scheduling.streams import ROUNDING, Stream, exceeds, utilization

Analysis = Literal["exact", "sum"]

MAX_ROUNDS = 100_000  # chosen: a longer search means a load within a millionth of the RC's capacity
FLOAT_MARGIN = 1e-9  # chosen: a million times the rounding of a sum of a thousand shares
LEAST_IDLE = 1e-4  # chosen: closer to a full load the linear bounds divide by too little to be of use


def admissible(streams: Sequence[Stream], capacity: float, analysis: Analysis = "exact") -> bool:
    """Return whether the RC can serve all these streams.

    Args:
        streams: Highest priority first.
        capacity: Part of its time that the RC may give, 0 to 1.
        analysis: ``exact``: every packet is done by its deadline. ``sum``: only the shares are added
            up, as the papers do; this admits sets that miss deadlines.
    """
    if exceeds(capacity, streams):
        return False
    if analysis == "sum":
        return True
    above = _Load()
    for one, blocking in zip(streams, _blockings_us(streams), strict=True):
        if not _in_time(one, above, blocking):
            return False
        above.add(one)
    return True


def worst_response_us(streams: Sequence[Stream], place: int) -> int | None:
    """Return the longest time from a release to the end of its packet, in microseconds.

    Args:
        streams: Highest priority first.
        place: Index of the stream.

    Returns:
        The response time of the worst case; None: it has no bound.
    """
    above = _Load()
    for one in streams[:place]:
        above.add(one)
    return _worst_us(streams[place], above, _blockings_us(streams)[place], enough_us=0)


def feasible_order(streams: Sequence[Stream], capacity: float) -> list[int] | None:
    """Return an order in which every packet is done by its deadline, if there is one.

    The lowest place is assigned first, to any stream that is in time there. The choice never spoils the rest, because a
    stream's response depends on the set of streams above it, not on their order. If several streams fit, the one with
    the longest deadline gets the place, so the order is deadline monotonic if that suffices.

    Args:
        streams: In any order.
        capacity: Part of its time that the RC may give, 0 to 1.

    Returns:
        Numbers of the streams, highest first; None: there is no such order.
    """
    if utilization(streams) > capacity + ROUNDING:
        return None
    remaining = sorted(range(len(streams)), key=lambda number: streams[number].deadline_us)
    order: list[int] = []
    longest_us = 1  # of the lower streams
    while remaining:
        lowest = next(_fit_below_all(streams, remaining, longest_us - 1), None)
        if lowest is None:
            return None
        remaining.remove(lowest)
        order.insert(0, lowest)
        longest_us = max(longest_us, streams[lowest].packet_us)
    return order


def remedy(streams: Sequence[tuple[str, Stream]], capacity: float) -> str:
    """Return a remedy for streams that do not fit in their given order; empty: only less demand would help.

    Args:
        streams: Names for people and streams whose user priorities are free to choose.
        capacity: Part of its time that the RC may give, 0 to 1.
    """
    order = feasible_order([one for _, one in streams], capacity)
    if order is None:
        return ""
    names = ", ".join(streams[number][0] for number in order)
    return f"They would all be in time if their priorities were in this order, highest first: {names}."


class _Load:
    """Streams above another one; equal streams count as one with a longer packet."""

    def __init__(self) -> None:
        self._packets_us: dict[tuple[int, int], int] = {}
        self.share = self.lag_us = self.burst_us = 0.0

    def add(self, one: Stream) -> None:
        """Add a stream."""
        key = one.period_us, one.jitter_us
        self._packets_us[key] = self._packets_us.get(key, 0) + one.packet_us
        share = one.packet_us / one.period_us
        self.share += share
        self.lag_us += share * one.jitter_us
        self.burst_us += share * one.jitter_us + one.packet_us

    def exact_share(self) -> Fraction:
        """Return the part of the RC's time that they need, without rounding."""
        return sum((Fraction(packet, period) for (period, _), packet in self._packets_us.items()), Fraction(0))

    def kinds(self) -> list[tuple[int, int, int]]:
        """Return period, jitter and packet time of each kind, microseconds."""
        return [(period, jitter, packet) for (period, jitter), packet in self._packets_us.items()]


def _blockings_us(streams: Sequence[Stream]) -> list[int]:
    """Return the blocking time of each stream, in µs: the longest lower packet, begun one tick ago."""
    blockings, longest_us = [0] * len(streams), 1
    for place in range(len(streams) - 1, -1, -1):
        blockings[place] = longest_us - 1
        longest_us = max(longest_us, streams[place].packet_us)
    return blockings


def _fit_below_all(streams: Sequence[Stream], remaining: Sequence[int], blocking: int) -> Iterator[int]:
    """Yield the streams that may have the lowest remaining place and are in time there; longest deadline first."""
    for number in reversed(remaining):
        above = _Load()
        for other in remaining:
            if other != number:
                above.add(streams[other])
        if _in_time(streams[number], above, blocking):
            yield number


def _in_time(one: Stream, above: _Load, blocking: int) -> bool:
    worst = _worst_us(one, above, blocking, enough_us=one.deadline_us)
    return worst is not None and worst <= one.deadline_us


def _worst_us(one: Stream, above: _Load, blocking: int, *, enough_us: int) -> int | None:
    """Return the worst response of the stream, microseconds, or ``enough_us`` if it is not longer.

    The analysis covers every packet of the busy period that begins when all higher streams are released at
    once, one tick after the longest lower packet began.
    """
    if not _has_end(one, above, blocking):
        return None
    idle = 1.0 - above.share
    upper_us = math.inf
    if idle > LEAST_IDLE:
        upper_us = (one.jitter_us + (blocking + above.burst_us) / idle + one.packet_us) * (1 + FLOAT_MARGIN) + 1
    if upper_us <= enough_us:
        return enough_us
    falls_us = one.period_us - one.packet_us / idle if idle > LEAST_IDLE else 0.0

    rounds = iter(range(MAX_ROUNDS))
    kinds = above.kinds()
    worst = begin = nth = 0
    packets = 1  # in the busy period, whose length is computed only if the first packet does not decide
    while nth < packets:
        own = blocking + nth * one.packet_us
        begin = max(begin, own)
        if idle > LEAST_IDLE:
            begin = max(begin, int((own + above.lag_us) / idle * (1 - FLOAT_MARGIN)) - 1)
        for _ in rounds:
            later = own + sum([((begin + jitter) // period + 1) * packet for period, jitter, packet in kinds])
            if later == begin:
                break
            begin = later
        else:
            return None
        worst = max(worst, one.jitter_us + begin - nth * one.period_us + one.packet_us)
        nth += 1
        if worst > enough_us > 0 or upper_us - nth * falls_us * (1 - FLOAT_MARGIN) <= max(worst, enough_us):
            break
        if nth == 1:
            busy = _busy_period_us(one, above, blocking, rounds)
            if busy is None:
                return None
            packets = -(-(busy + one.jitter_us) // one.period_us)
    return max(worst, enough_us)


def _has_end(one: Stream, above: _Load, blocking: int) -> bool:
    """Return whether the busy period of these streams has an end.

    At full load it ends only without jitter: a late packet delays all later ones for ever.
    """
    roughly = above.share + one.packet_us / one.period_us
    if roughly < 1 - FLOAT_MARGIN:
        return True
    if roughly > 1 + FLOAT_MARGIN:
        return False
    exactly = above.exact_share() + one.share
    return exactly < 1 or (exactly == 1 and blocking == 0 and not one.jitter_us and not above.lag_us)


def _busy_period_us(one: Stream, above: _Load, blocking: int, rounds: Iterator[int]) -> int | None:
    """Return the longest busy period of these streams; None: the search takes too long."""
    kinds = [*above.kinds(), (one.period_us, one.jitter_us, one.packet_us)]
    share = one.packet_us / one.period_us
    busy, idle = blocking + one.packet_us, 1.0 - above.share - share
    if idle > LEAST_IDLE:
        lag_us = above.lag_us + share * one.jitter_us
        busy = max(busy, int((blocking + lag_us) / idle * (1 - FLOAT_MARGIN)) - 1)
    for _ in rounds:
        longer = blocking + sum([-(-(busy + jitter) // period) * packet for period, jitter, packet in kinds])
        if longer == busy:
            return busy
        busy = longer
    return None
