"""Beats: finds ARCs that hang, by the time since each one's last beat.

Rules of this file: pure; the caller owns the clock.

* At most ``LOOK_MOST_S`` of the time between two checks counts as silence. A paused RC manager receives nothing, and
  beats sent meanwhile arrive only after it continues.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from backbone.rc_manager.messages import BEAT_MISSED_S, RENEW_EVERY_S

LOOK_MOST_S = 1.5 * RENEW_EVERY_S  # chosen: a check may be late by half its period


@dataclass
class Beats:
    """The last beat of each ARC with a request.

    Attributes:
        rate: Seconds of the clock per second of the machine.
        heard_s: ARC → when it beat last.
    """

    rate: float = 1.0
    heard_s: dict[str, float] = field(default_factory=dict)
    _looked_s: float | None = None

    def heard(self, arc: str, now_s: float) -> None:
        """Note a beat, or a request, of the ARC."""
        self.heard_s[arc] = now_s

    def forget(self, arc: str) -> bool:
        """Expect no more beats of the ARC; return whether any were."""
        return self.heard_s.pop(arc, None) is not None

    def look(self, now_s: float) -> dict[str, float]:
        """Return the ARCs that hang, with the seconds of the machine since their last beat, and forget them.

        Args:
            now_s: Seconds of the clock; checks are ``RENEW_EVERY_S`` of the machine apart.
        """
        paused_s = 0.0 if self._looked_s is None else max(0.0, now_s - self._looked_s - LOOK_MOST_S * self.rate)
        self._looked_s = now_s
        if paused_s:
            self.heard_s = {arc: min(now_s, at_s + paused_s) for arc, at_s in self.heard_s.items()}
        silent = {arc: (now_s - at_s) / self.rate for arc, at_s in self.heard_s.items()}
        hung = {arc: silent_s for arc, silent_s in silent.items() if silent_s > BEAT_MISSED_S}
        for arc in hung:
            del self.heard_s[arc]
        return hung
