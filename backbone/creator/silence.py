"""Silence: for how long a process has shown no sign of life, time it could not run not counted.

Rules of this file: pure; looks at a process go in, seconds come out. The caller owns the clock.

* A beat ends the silence.
* Time in which the process waited for a processor is not silence: a starved process is late, not hung.
* Of a gap between two looks at most ``LOOK_MOST_S`` counts: if the supervisor itself was paused, its processes
  may have been paused with it.
* Before a process's first beat, processor time that it uses is a sign of life too: it imports, it opens a renderer.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from backbone.component.heartbeat import Vitals

LOOK_EVERY_S = 0.2  # chosen: a little more often than a process beats
LOOK_MOST_S = 0.4  # chosen: twice the period: one look may be missed
SHOWN_AFTER_S = 0.55  # chosen: three looks; told 0.8 s after a process stopped, with the look that saw its last beat


@dataclass
class Silence:
    """The silence of one process; make one when the process begins.

    Attributes:
        silent_s: Seconds of the machine without a sign of life.
    """

    silent_s: float = 0.0
    _last: Vitals = field(default_factory=lambda: Vitals(-1))
    _looked_s: float = -1.0

    def look(self, vitals: Vitals, now_s: float) -> float:
        """Take one look at the process and return for how long it has been silent.

        Args:
            vitals: What the look shows.
            now_s: Seconds of the machine.
        """
        last, elapsed_s = self._last, now_s - self._looked_s
        self._last, self._looked_s = vitals, now_s
        if vitals.beats != last.beats:
            self.silent_s = 0.0
            return 0.0
        excused_s = vitals.queued_s - last.queued_s
        if vitals.beats == 0:
            excused_s += vitals.ran_s - last.ran_s
        self.silent_s += max(0.0, min(elapsed_s, LOOK_MOST_S) - max(0.0, excused_s))
        return self.silent_s
