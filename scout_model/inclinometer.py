"""Tilt of a robot, from its accelerometer: the smoothed direction of the supporting force.

A reading holds until the next one, so a robot whose readings stay the same needs no update.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SMOOTHING_S = 0.25  # chosen: several frames, so that a bump does not count as a fall; much shorter than a fall

_WEIGHTLESS_M_S2 = 1.0  # chosen: a tenth of gravity; below it the direction is meaningless


class Inclinometer:
    """The tilt sensor of one robot; it reports upright until the first reading."""

    def __init__(self) -> None:
        self._held_m_s2 = self._smooth_m_s2 = (0.0, 0.0, 9.81)
        self._since_s = 0.0
        self._tilt_rad = 0.0

    def feel(self, acceleration_m_s2: Sequence[float], now_s: float) -> None:
        """Record a reading.

        Args:
            acceleration_m_s2: As an accelerometer measures it, forward, left and up; 9.81 up at rest.
            now_s: Time, never before an earlier call's.
        """
        self._advance(now_s)
        forward, left, up = acceleration_m_s2
        self._held_m_s2 = forward, left, up

    def tilt_rad(self, now_s: float) -> float:
        """Return the angle between the robot's up axis and the vertical, 0 to pi; in free fall, the last angle."""
        self._advance(now_s)
        forward, left, up = self._smooth_m_s2
        across = math.hypot(forward, left)
        if math.hypot(across, up) >= _WEIGHTLESS_M_S2:
            self._tilt_rad = math.atan2(across, up)
        return self._tilt_rad

    def _advance(self, now_s: float) -> None:
        rest = math.exp((self._since_s - now_s) / SMOOTHING_S)
        (x, y, z), (held_x, held_y, held_z) = self._smooth_m_s2, self._held_m_s2
        self._smooth_m_s2 = held_x + (x - held_x) * rest, held_y + (y - held_y) * rest, held_z + (z - held_z) * rest
        self._since_s = now_s
