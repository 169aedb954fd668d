"""Slow packets: for each ARC and kind of packet, the longest time on the air, if it is longer than declared.

Rules of this file:

* Times are rounded up to multiples of ``STEP_S``, so that a slowly growing time is reported only a few times.
* A longer time is reported with the next packet of its kind, but not within ``EVERY_S`` after the last report.
* An ARC's times are deleted when it is disconnected; the RC manager remembers them until the ARC leaves.

Pure; times are mission seconds.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from backbone.rc_manager.messages import LONGEST_PACKET_S
from backbone.scheduling.requests import MeasuredPackets

EVERY_S = 1.0  # chosen: each longer time changes an ARC's request; no plan changes faster than slices end
STEP_S = 1e-4  # chosen: a byte on the air at 115.2 kbit/s
ROUNDING = 1e-6  # chosen: of a step; far above a division's rounding error, far below a measurement's resolution


@dataclass(slots=True)
class _Kind:
    longest_s: float = 0.0
    told_s: float = 0.0
    told_at_s: float = -math.inf


class SlowPackets:
    """The slow packets of one radio.

    Args:
        every_s: Least time between two reports of one kind.
    """

    def __init__(self, every_s: float = EVERY_S) -> None:
        self._every_s = every_s
        self._arcs: dict[str, dict[str, _Kind]] = {}

    def took(self, arc: str, kind: str, declared_s: float, took_s: float, now_s: float) -> bool:
        """Record a packet's time on the air; return whether a longer time must be reported now.

        A time that is not longer than declared is ignored. A time above ``LONGEST_PACKET_S`` counts as
        ``LONGEST_PACKET_S``.

        Example:
            >>> packets = SlowPackets()
            >>> packets.took("patrol-drive", "drive", 0.002, 0.00434, 12.0)
            True
            >>> packets.told(["patrol-drive"])[0].packet_time_s
            0.0044
        """
        if not took_s > declared_s:
            return False
        one = self._arcs.setdefault(arc, {}).setdefault(kind, _Kind())
        one.longest_s = max(one.longest_s, _rounded_up(min(took_s, LONGEST_PACKET_S)))
        if one.longest_s <= one.told_s or now_s < one.told_at_s + self._every_s:
            return False
        one.told_s, one.told_at_s = one.longest_s, now_s
        return True

    def told(self, arcs: Collection[str]) -> list[MeasuredPackets]:
        """Return the times reported for these ARCs."""
        return [
            MeasuredPackets(arc, kind, one.told_s)
            for arc in arcs
            for kind, one in self._arcs.get(arc, {}).items()
            if one.told_s > 0.0
        ]

    def forget(self, arc: str) -> None:
        """Delete the times of a disconnected ARC."""
        self._arcs.pop(arc, None)


def _rounded_up(seconds: float) -> float:
    return round(math.ceil(seconds / STEP_S - ROUNDING) * STEP_S, 9)
