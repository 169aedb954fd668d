"""Link speed: whether commands come through the link between an offered machine and the hub in time.

A command from an ARC to an RC on another host crosses the links of both hosts, and so does its answer. The limits for
an answer do not follow the round trip, because a command that old would move a robot after a halt that overtook it
(decision 0041). So a slow link is reported instead. Pure: round trips go in, an absence comes out.
"""

from __future__ import annotations

from collections import deque

from backbone.component.messages import Absence

SLOW_S = 0.2  # measured: with such links of both hosts a command was answered after 0.82 s, with 0.4 s none within 1 s
ASKED_TIMES = 3  # chosen: a lost packet or a busy process delays one answer, seldom three in succession
TOLD_AGAIN = 1.25  # chosen: people act on no smaller change


class LinkSpeed:
    """The speed of one machine's link.

    Attributes:
        absence: The machine, while each of the last ``ASKED_TIMES`` round trips took at least ``SLOW_S``; else None.
    """

    def __init__(self, host: str) -> None:
        self._host, self._told_s = host, 0.0
        self._last_s: deque[float] = deque(maxlen=ASKED_TIMES)
        self.absence: Absence | None = None

    def measured(self, round_trip_s: float, now_s: float) -> bool:
        """Record a round trip to the hub, in seconds of the machine; return whether ``absence`` has changed."""
        self._last_s.append(round_trip_s)
        shortest_s, before = min(self._last_s), self.absence
        if len(self._last_s) < ASKED_TIMES or shortest_s < SLOW_S:
            self.absence = None
        elif before is None or not self._told_s / TOLD_AGAIN < shortest_s < self._told_s * TOLD_AGAIN:
            self._told_s = shortest_s
            self.absence = _slow(self._host, shortest_s, now_s if before is None else before.since_s)
        return self.absence is not before


def _slow(host: str, round_trip_s: float, since_s: float) -> Absence:
    cause = f"its link is slow: a round trip to the hub takes {round_trip_s:.2f} s, so commands come late or not at all"
    remedy = "check the link; let an ARC, its RCs and its owner run on one host, so that commands do not cross the link"
    return Absence(host, since_s, cause, "goes on", remedy, is_running=True)
