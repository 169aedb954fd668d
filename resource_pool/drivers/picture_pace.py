"""Pace of a renderer: limits its picture rate, so that on a full processor pictures are dropped before control suffers.

Control has priority over pictures. A renderer's event loop shares the processors with ARCs and RCs: if the loop wakes
too late, so do they. If the loop is late too often, the renderer lowers its rate. After a while without delays it
raises the rate again, up to the requested one. Before it retries a rate that was too high, it waits longer each time.

Rules of this file: pure; times are arguments, in seconds of the machine; the caller owns the clock.
"""

from __future__ import annotations

import math

LATE_S = 0.01  # measured: 1 of 250 pictures of 30 Scouts on two cores with other work, 1 of 6 of 100 Scouts
WINDOW_S = 2.0  # chosen: 30 pictures at 15 a second; a slice of 5 s has two
LATE_SHARE = 1 / 15  # chosen: between the two measured shares
LATE_LEAST = 2  # chosen: one late picture proves nothing
CALM_WINDOWS, CALM_MOST = 2, 16  # chosen: falls after one window, rises after two, overshoots twice a minute
SLOWER, FASTER = 2 / 3, 5 / 4  # chosen: the rate is a little more than halved in two windows, and doubled in six
LEAST_HZ = 1.0  # chosen: a person and a motion detector still notice changes in the picture


class PicturePace:
    """The allowed rate of one renderer.

    Args:
        asked_hz: Picture rate that the mission file requests.
    """

    def __init__(self, asked_hz: float) -> None:
        self.asked_hz = self.allowed_hz = asked_hz
        self._from_s = -math.inf
        self._pictures = self._late = self._calm = 0
        self._needed, self._too_much_hz = CALM_WINDOWS, math.inf

    def ask(self, asked_hz: float) -> None:
        """Request another rate; it is allowed up to the present limit, or in full without a limit."""
        was_free, self.asked_hz = self.allowed_hz >= self.asked_hz, asked_hz
        self.allowed_hz = asked_hz if was_free else min(self.allowed_hz, asked_hz)

    def delivered(self, late_s: float, now_s: float) -> bool:
        """Count a delivered picture; return whether the allowed rate has changed.

        Args:
            late_s: Delay of the event loop for this picture.
            now_s: Time of delivery.
        """
        if now_s >= self._from_s + 2 * WINDOW_S:  # no pictures meanwhile, because no ARC held the framegrabber
            self._begin_window(now_s)
        self._pictures += 1
        self._late += late_s > LATE_S
        if now_s < self._from_s + WINDOW_S:
            return False
        before = self.allowed_hz
        self.allowed_hz = self._decided_hz()
        self._begin_window(now_s)
        return self.allowed_hz != before

    def remark(self) -> str:
        """Return one line for people; empty while the rate is the requested one.

        Example:
            >>> pace = PicturePace(15.0)
            >>> pace.remark()
            ''
        """
        if self.allowed_hz >= self.asked_hz:
            return ""
        return f"{self.allowed_hz:.3g} of {self.asked_hz:.3g} pictures a second: control goes first on a full processor"

    def _decided_hz(self) -> float:
        if self._late >= LATE_LEAST and self._late >= LATE_SHARE * self._pictures:
            if self.allowed_hz >= self._too_much_hz:
                self._needed = min(2 * self._needed, CALM_MOST)
            self._calm, self._too_much_hz = 0, self.allowed_hz
            return min(self.asked_hz, max(LEAST_HZ, self.allowed_hz * SLOWER))
        self._calm = self._calm + 1 if self._late == 0 else 0
        faster_hz = min(self.asked_hz, self.allowed_hz * FASTER)
        if self._calm < (CALM_WINDOWS if faster_hz < self._too_much_hz else self._needed):
            return self.allowed_hz
        if self.allowed_hz >= self._too_much_hz:  # it is not any more
            self._needed, self._too_much_hz = CALM_WINDOWS, math.inf
        self._calm = 0
        return faster_hz

    def _begin_window(self, now_s: float) -> None:
        self._from_s, self._pictures, self._late = now_s, 0, 0
