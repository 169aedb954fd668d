"""SwitchTimes: durations of hand-overs between ARCs, from revocation to grant, without settling. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

KEPT = 10_000  # chosen: half a day of 5 s slices, 80 kB


class SwitchTimes:
    """The newest switches."""

    def __init__(self) -> None:
        """Begin without switches."""
        self._revoked: dict[str, tuple[float, str]] = {}  # RC → time and ARC of the revocation
        self._times_s: deque[float] = deque(maxlen=KEPT)

    def revoked(self, rcs: Iterable[str], arc: str, now_s: float) -> None:
        """Record that these RCs are being revoked from an ARC."""
        self._revoked |= dict.fromkeys(rcs, (now_s, arc))

    def granted(self, rcs: Iterable[str], arc: str, settle_s: float, now_s: float) -> None:
        """Record a grant; it ends a switch if an RC was revoked from another ARC before."""
        revoked = [self._revoked.pop(rc) for rc in rcs if rc in self._revoked]
        from_others = [at_s for at_s, other in revoked if other != arc]
        if from_others:
            self._times_s.append(now_s - min(from_others) - settle_s)

    def statistics(self) -> dict[str, float]:
        """Return the number of switches, and the median and 99th percentile of their times."""
        times = sorted(self._times_s)
        return {
            "switches": float(len(times)),
            "switch_p50_s": times[len(times) // 2] if times else 0.0,
            "switch_p99_s": times[min(len(times) - 1, len(times) * 99 // 100)] if times else 0.0,
        }
