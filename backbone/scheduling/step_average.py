"""StepAverage: the average of a value that changes in steps, over the last minutes.

Rules of this file: pure; the caller owns the clock. One integral is kept for each of the last ``SLOTS_KEPT`` slots of
``SLOT_S``, however many steps there are.
"""

from __future__ import annotations

from collections import deque

SLOT_S = 10.0  # chosen: a sixth of the shortest time that people ask for
SLOTS_KEPT = 60
LONGEST_S = SLOT_S * SLOTS_KEPT


class StepAverage:
    """A value of 0 at first, and its average.

    Args:
        began_s: Begin of the first slot; no average includes earlier time.
    """

    def __init__(self, began_s: float) -> None:
        self._began_s = self._at_s = began_s
        self._value = self._integral = 0.0
        self._slot = 0
        self._at_begin = deque([0.0], maxlen=SLOTS_KEPT + 1)  # integral at the begin of each slot, the newest last

    def step_to(self, value: float, now_s: float) -> None:
        """Set the value from now on; a time before the last one counts as the last one.

        Cost: one step, and one for each slot since the last call, at most ``SLOTS_KEPT`` + 1.
        """
        self._advance(now_s)
        self._value = value

    def over(self, last_s: float, now_s: float) -> float:
        """Return the average since the begin of the slot ``last_s`` ago.

        Args:
            last_s: A multiple of ``SLOT_S``, at most ``LONGEST_S``.
        """
        self._advance(now_s)
        slots = min(round(last_s / SLOT_S), self._slot)
        since_s = self._began_s + (self._slot - slots) * SLOT_S
        if self._at_s <= since_s:
            return self._value
        return (self._integral - self._at_begin[-1 - slots]) / (self._at_s - since_s)

    def _advance(self, now_s: float) -> None:
        now_s = max(now_s, self._at_s)
        slot = int((now_s - self._began_s) // SLOT_S)
        for begun in range(max(self._slot + 1, slot - SLOTS_KEPT), slot + 1):
            begun_s = self._began_s + begun * SLOT_S
            self._at_begin.append(self._integral + self._value * (begun_s - self._at_s))
        self._integral += self._value * (now_s - self._at_s)
        self._slot, self._at_s = slot, now_s
