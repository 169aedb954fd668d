"""Streams: the periodic packets of an ARC on a sharable RC, in whole microseconds.

No answer about them depends on rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from backbone.scheduling.requests import Usage

ROUNDING = 1e-9  # chosen: three shares of 0.1 fit a capacity of 0.3


class Stream(NamedTuple):
    """Periodic packets of one ARC, times in whole microseconds."""

    period_us: int
    packet_us: int
    deadline_us: int
    jitter_us: int

    @property
    def share(self) -> Fraction:
        """Part of the RC's time that the stream needs, 0 to 1."""
        return Fraction(self.packet_us, self.period_us)


def stream(usage: Usage) -> Stream:
    """Return the usage in whole microseconds; a deadline of 0 is the period."""
    deadline_s = usage.deadline_s or usage.period_s
    return Stream(
        *(round(time_s * 1e6) for time_s in (usage.period_s, usage.packet_time_s, deadline_s, usage.jitter_s))
    )


def utilization(streams: Sequence[Stream]) -> float:
    """Return the part of the RC's time that the streams need together."""
    return sum(one.packet_us / one.period_us for one in streams)


def exceeds(capacity: float, streams: Sequence[Stream]) -> bool:
    """Return whether their common demand exceeds the RC's capacity, in any order."""
    return utilization(streams) > capacity + ROUNDING
