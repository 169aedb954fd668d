"""Unit schedule: decides when an execution unit has a round.

Pure: time is an argument. Ticks of a frequency lie on a grid that begins at the unit's start, so a late round does not
delay later ones. Ticks that have passed when a round begins are missed and not made up for.

Source: RoboFrame 2006, section III: threads are executed at a given frequency and / or on new input.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection
from enum import StrEnum
from typing import Annotated

import msgspec

RATE_OVER = 64  # chosen: covers a third of a second at the highest rate, a minute at one round a second
OVERDUE = 3.0  # chosen: mean periods without a round; the rounds of an input that jitters are no farther apart
MOST_HZ = 1000.0  # chosen: the resolution of an event loop's timers is a millisecond


class OnInput(StrEnum):
    """The new inputs from outside the unit that begin a round."""

    NONE = "none"
    ANY = "any"
    ALL = "all"


class Trigger(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Condition for a unit's rounds: a frequency, new input, or both.

    Attributes:
        frequency_hz: Rounds a second; 0: only on input.
        on_input: ``any``: at each fresh input from outside the unit; ``all``: when all fresh inputs have arrived since
            the last such round; ``none``: only at the frequency.
    """

    frequency_hz: Annotated[float, msgspec.Meta(ge=0, le=MOST_HZ)] = 0.0
    on_input: OnInput = OnInput.ANY

    def __post_init__(self) -> None:
        if not 0 <= self.frequency_hz <= MOST_HZ:  # msgspec compares with the range only what it decodes
            raise ValueError(f"a frequency of {self.frequency_hz} Hz; give one from 0 to {MOST_HZ:g}")
        if self.frequency_hz == 0 and self.on_input is OnInput.NONE:
            raise ValueError("a unit without a frequency that runs on no input never runs; give it one of them")


class UnitSchedule:
    """The rounds of one unit.

    Args:
        trigger: Condition for rounds.
        awaited: Keys of the fresh inputs from outside the unit.
        start_s: Time of the first tick.
    """

    def __init__(self, trigger: Trigger, awaited: Collection[str], start_s: float) -> None:
        self._trigger, self._awaited, self._start_s = trigger, frozenset(awaited), start_s
        self._arrived: set[str] = set()
        self._tick = 0  # number of the next tick
        self._rounds_s: deque[float] = deque(maxlen=RATE_OVER)
        self.rounds = self.ticks = self.missed = 0
        self.late_s = self.most_late_s = 0.0
        """Sum of all ticks' lateness, and the longest; seconds."""

    @property
    def due_s(self) -> float:
        """Time of the next tick; infinite without a frequency."""
        frequency_hz = self._trigger.frequency_hz
        return self._start_s + self._tick / frequency_hz if frequency_hz else math.inf

    def arrived(self, key: str) -> bool:
        """Record a new value from outside; return whether a round is due because of it."""
        if key not in self._awaited or self._trigger.on_input is OnInput.NONE:
            return False
        if self._trigger.on_input is OnInput.ANY:
            return True
        self._arrived.add(key)
        if self._arrived != self._awaited:
            return False
        self._arrived.clear()
        return True

    def tick(self, now_s: float) -> bool:
        """Return whether a round is due because of the time; if so, the next tick lies in the future."""
        if now_s < self.due_s:
            return False
        late_s = now_s - self.due_s
        self.ticks += 1
        self.late_s, self.most_late_s = self.late_s + late_s, max(self.most_late_s, late_s)
        served, self._tick = self._tick, self._tick + 1
        if self.due_s <= now_s:
            self._tick = max(self._tick, math.floor((now_s - self._start_s) * self._trigger.frequency_hz))
        while self.due_s <= now_s:
            self._tick += 1
        self.missed += self._tick - served - 1
        return True

    def began(self, now_s: float) -> None:
        """Record that a round begins."""
        self.rounds += 1
        self._rounds_s.append(now_s)

    def rate_hz(self, now_s: float) -> float:
        """Return the rate over the last ``RATE_OVER`` rounds, Hz; it falls while no round begins.

        It is 0 before the second round.
        """
        periods = len(self._rounds_s) - 1
        if periods < 1:
            return 0.0
        first_s, last_s = self._rounds_s[0], self._rounds_s[-1]
        is_overdue = (now_s - last_s) * periods > OVERDUE * (last_s - first_s)
        span_s = (now_s if is_overdue else last_s) - first_s
        return periods / span_s if span_s > 0 else 0.0
