"""SwitchTimes: durations of hand-overs between ARCs, from revocation to grant, without settling. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

KEPT = 10_000  # chosen: half a day of 5 s slices, 80 kB


class SwitchTimes:
    """The newest switches."""

    def __init__(self) -> None:
        """Begin without switches."""
        self._revoked: dict[str, tuple[float, str]] = {}  # RC → time of its revocation, and for which ARC
        self._times_s: deque[float] = deque(maxlen=KEPT)

    def revoked(self, rcs: Iterable[str], by: str, now_s: float) -> None:
        """Record that these RCs are being revoked for an ARC, or, if ``by`` names none, for another reason."""
        self._revoked |= dict.fromkeys(rcs, (now_s, by))

    def granted(self, rcs: Iterable[str], arc: str, settle_s: float, now_s: float) -> None:
        """Record a grant; it ends a switch if an RC was revoked for this ARC before."""
        revoked = [self._revoked.pop(rc) for rc in rcs if rc in self._revoked]
        for_it = [at_s for at_s, by in revoked if by == arc]
        if for_it:
            self._times_s.append(now_s - min(for_it) - settle_s)

    def statistics(self) -> dict[str, float]:
        """Return the number of switches, and the median and 99th percentile of their times."""
        times = sorted(self._times_s)
        return {
            "switches": float(len(times)),
            "switch_p50_s": times[len(times) // 2] if times else 0.0,
            "switch_p99_s": times[min(len(times) - 1, len(times) * 99 // 100)] if times else 0.0,
        }
