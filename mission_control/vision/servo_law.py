"""How fast to drive and turn towards the landmark without losing it from the narrow view.

Source: RAM 2002, "Visual Servoing" and figure 8: forward, rotate, back off, approach again, until the
robot stands on the zero-angle line of the target.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Stage(StrEnum):
    """Where an approach is."""

    SEARCHING = "searching"
    FORWARD = "forward"
    BACKING = "backing"
    SETTLING = "settling"
    ARRIVED = "arrived"


@dataclass(frozen=True, slots=True)
class Command:
    """What the robot shall do until the next one.

    Attributes:
        forward_m_s: Speed of its middle.
        turn_rad_s: Counter-clockwise is positive.
    """

    forward_m_s: float
    turn_rad_s: float

    def wheels_rad_s(self, track_m: float = 0.098, wheel_radius_m: float = 0.02) -> tuple[float, float]:
        """Return the speeds of the left and right wheel; the default sizes are the Scout's."""
        half_m_s = self.turn_rad_s * track_m / 2
        return (self.forward_m_s - half_m_s) / wheel_radius_m, (self.forward_m_s + half_m_s) / wheel_radius_m


HALT = Command(0.0, 0.0)
