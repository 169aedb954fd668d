"""Silence: the time for which a process has shown no sign of life, except time in which it could not run.

Rules of this file: pure; readings of a process go in, seconds come out. The caller owns the clock.

* A beat ends the silence.
* Time in which the process waited for a processor is not silence: a starved process is late, not hung.
* At most ``LOOK_MOST_S`` of a gap between two readings counts, because a pause of the supervisor may have paused its
  processes too.
* How long it could not run is known apart from its silence, because it extends the time that a process has to end.
* Before a process's first beat, its use of processor time is a sign of life too: it imports or opens a renderer.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from backbone.component.heartbeat import Vitals

LOOK_EVERY_S = 0.2  # chosen: a little more often than a process beats
LOOK_MOST_S = 0.4  # chosen: twice the period, so that one reading may be missed
SHOWN_AFTER_S = 0.55  # chosen: three readings; reported 0.8 s after the last beat


@dataclass
class Silence:
    """The silence of one process, from its start on.

    Attributes:
        silent_s: Seconds of the machine without a sign of life.
        late_s: Seconds of the machine, between its last two readings, in which it could not run or was not looked at.
    """

    silent_s: float = 0.0
    late_s: float = 0.0
    _last: Vitals = field(default_factory=lambda: Vitals(-1))
    _looked_s: float = -1.0

    def look(self, vitals: Vitals, now_s: float) -> float:
        """Add one reading of the process and return the duration of its silence."""
        last, elapsed_s = self._last, now_s - self._looked_s
        is_first = self._looked_s < 0
        self._last, self._looked_s = vitals, now_s
        missed_s = max(0.0, elapsed_s - LOOK_MOST_S) + max(0.0, vitals.queued_s - last.queued_s)
        self.late_s = 0.0 if is_first else min(elapsed_s, missed_s)
        if vitals.beats != last.beats:
            self.silent_s = 0.0
            return 0.0
        excused_s = vitals.queued_s - last.queued_s
        if vitals.beats == 0:
            excused_s += vitals.ran_s - last.ran_s
        self.silent_s += max(0.0, min(elapsed_s, LOOK_MOST_S) - max(0.0, excused_s))
        return self.silent_s
