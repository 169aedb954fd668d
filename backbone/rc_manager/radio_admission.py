"""Which streams a sharable RC can serve together so that each packet is done in time.

A sharable RC sends one packet at a time and never breaks one off. Among waiting packets the one of
the highest user priority goes first, then the one of the shorter period (rate monotonic), then the
first by name. Whether all deadlines hold is decided exactly, by response-time analysis of every
packet in the longest busy period; looking at the first packet only is too optimistic for a
non-preemptive server.

Rule of this file: times are whole microseconds, so that no answer depends on rounding.

Source: RAM 2002, "Sharable Resources"; Davis, Burns, Bril, Lukkien, "Controller Area Network (CAN)
schedulability analysis: refuted, revisited and revised", Real-Time Systems 35, 2007.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Literal, NamedTuple

from backbone.rc_manager.messages import Usage

Analysis = Literal["exact", "sum"]

MAX_ROUNDS = 100_000  # chosen: a busy period that is not found by then is minutes long; such a load is refused
ROUNDING = 1e-9  # chosen: three shares of 0.1 fit a capacity of 0.3


class Stream(NamedTuple):
    """Periodic packets of one ARC, times in whole microseconds."""

    period_us: int
    packet_us: int
    deadline_us: int
    jitter_us: int

    @property
    def share(self) -> Fraction:
        """Part of the RC's time it needs, 0 to 1."""
        return Fraction(self.packet_us, self.period_us)


def stream(usage: Usage) -> Stream:
    """Return the usage in whole microseconds; a deadline of 0 is the period."""
    deadline_s = usage.deadline_s or usage.period_s
    return Stream(
        *(round(time_s * 1e6) for time_s in (usage.period_s, usage.packet_time_s, deadline_s, usage.jitter_s))
    )


def utilization(streams: Sequence[Stream]) -> float:
    """Return the part of the RC's time they need together."""
    return sum(one.packet_us / one.period_us for one in streams)


def admissible(streams: Sequence[Stream], capacity: float, analysis: Analysis = "exact") -> bool:
    """Say whether the RC can serve all of them.

    Args:
        streams: Highest priority first.
        capacity: Part of its time the RC may give, 0 to 1.
        analysis: ``exact``: every packet is done by its deadline. ``sum``: only the shares are added
            up, as the papers do; this admits sets that miss deadlines.
    """
    if utilization(streams) > capacity + ROUNDING:
        return False
    if analysis == "sum":
        return True
    return all(
        all(response <= one.deadline_us for response in _responses_us(streams, place))
        for place, one in enumerate(streams)
    )


def worst_response_us(streams: Sequence[Stream], place: int) -> int | None:
    """Return the longest time from a release to the end of its packet, in microseconds.

    Args:
        streams: Highest priority first.
        place: Index of the stream asked about.

    Returns:
        The response time that does occur in the worst case; None: it has no bound.
    """
    worst = 0
    for response in _responses_us(streams, place):
        if response == _NO_BOUND:
            return None
        worst = max(worst, response)
    return worst


_NO_BOUND = 2**63


def _responses_us(streams: Sequence[Stream], place: int) -> Iterator[int]:
    """Yield the response of each packet in the busy period that begins when all higher ones are released at once."""
    own, above = streams[place], streams[:place]
    # A lower packet that began just before, by one tick, is sent to its end.
    blocking = max((lower.packet_us for lower in streams[place + 1 :]), default=1) - 1
    busy = _busy_period_us(streams[: place + 1], blocking)
    if busy is None:
        yield _NO_BOUND
        return
    packets = -(-(busy + own.jitter_us) // own.period_us)
    begin = blocking
    for nth in range(packets):
        begin = max(begin, blocking + nth * own.packet_us)
        while True:
            earlier = nth * own.packet_us + sum(
                ((begin + other.jitter_us) // other.period_us + 1) * other.packet_us for other in above
            )
            if blocking + earlier == begin:
                break
            begin = blocking + earlier
        yield own.jitter_us + begin - nth * own.period_us + own.packet_us


def _busy_period_us(streams: Sequence[Stream], blocking: int) -> int | None:
    """Return how long the RC can be busy with these streams without a pause; None: for ever, or too long to tell."""
    load = sum((one.share for one in streams), Fraction(0))
    if load > 1 or (load == 1 and blocking > 0):
        return None
    busy = blocking + streams[-1].packet_us
    for _ in range(MAX_ROUNDS):
        longer = blocking + sum(-(-(busy + one.jitter_us) // one.period_us) * one.packet_us for one in streams)
        if longer == busy:
            return busy
        busy = longer
    return None
