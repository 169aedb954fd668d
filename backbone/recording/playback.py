"""Playback: the time of a recording, which a person can stop, continue and move to any instant."""

from __future__ import annotations

import asyncio
import math

from backbone.bus.interface import Clock
from backbone.errors import Refusal
from backbone.waiting import set_within

SLOWEST, FASTEST = 0.1, 100.0  # chosen: at a tenth each packet is visible; at a hundred an hour takes a minute

LEAST_WAIT_S = 1e-6  # chosen: rounding can leave a rest that is too small ever to pass


class NoSuchTime(Refusal):
    """A recording cannot be played at this time or speed."""

    code = "recording.time"
    remedy = f"Name a time in seconds, and a speed from {SLOWEST:g} to {FASTEST:g}."


class Playback:
    """A clock of mission time that stands still until ``play``.

    Durations pass as on the machine, at the speed of playing, even while mission time stands still. So a console keeps
    drawing. Only ``sleep_until_s`` waits for mission time.

    Args:
        machine: Clock whose seconds are those of the machine.
        begin_s: First mission time.
        end_s: Last mission time; it stops there.
    """

    def __init__(self, machine: Clock, begin_s: float, end_s: float) -> None:
        self.begin_s, self.end_s = begin_s, max(begin_s, end_s)
        self.is_playing = False
        self._machine, self._speed = machine, 1.0
        self._since_s = self._at_s = begin_s
        self._changed = asyncio.Event()

    @property
    def rate(self) -> float:
        """Mission seconds per second of the machine while it plays."""
        return self._speed

    def now_s(self) -> float:
        """Return the mission time."""
        if not self.is_playing:
            return self._at_s
        return min(self.end_s, self._at_s + (self._machine.now_s() - self._since_s) * self._speed)

    def play(self, speed: float) -> None:
        """Let mission time pass from now on, ``speed`` seconds per second of the machine.

        Raises:
            NoSuchTime: The speed is out of range.
        """
        if not SLOWEST <= speed <= FASTEST:
            raise NoSuchTime(f"nothing can be played at a speed of {speed:g}")
        self._stand(self.now_s())
        self._speed, self.is_playing = speed, self._at_s < self.end_s
        self._changed.set()

    def pause(self) -> None:
        """Stop mission time."""
        self._stand(self.now_s())
        self._changed.set()

    def go_to(self, at_s: float) -> None:
        """Move to a mission time, limited to the recording; continue playing if it was playing.

        Raises:
            NoSuchTime: The time is not a number.
        """
        if not math.isfinite(at_s):
            raise NoSuchTime(f"{at_s} is no time")
        was_playing = self.is_playing
        self._stand(min(self.end_s, max(self.begin_s, at_s)))
        self.is_playing = was_playing and self._at_s < self.end_s
        self._changed.set()

    async def sleep_s(self, duration_s: float) -> None:
        """Sleep as long as so many mission seconds last while playing; yield at least once."""
        await self._machine.sleep_s(duration_s / self._speed * self._machine.rate)

    async def sleep_until_s(self, at_s: float) -> None:
        """Sleep until this mission time; yield at least once, even if it has passed."""
        await self._machine.sleep_s(0.0)
        while self.now_s() < at_s:
            self._changed.clear()
            missing_s = max(LEAST_WAIT_S, (at_s - self.now_s()) / self._speed)
            await set_within(self._changed, missing_s if self.is_playing and at_s <= self.end_s else None)

    def _stand(self, at_s: float) -> None:
        self.is_playing, self._at_s, self._since_s = False, at_s, self._machine.now_s()
