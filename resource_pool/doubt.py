"""Doubt: the uncertainty of a dead-reckoned pose, as the covariance of place and heading.

On the way out an error of the heading adds to the error of the place; on the way back it reduces that error again.
Errors of way and turn are independent, so variances grow in proportion to both.

Source: Thrun, Burgard and Fox, "Probabilistic Robotics", 2005, section 3.3: prediction of an extended Kalman filter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

PLACE_M2_PER_M = 0.0016  # chosen: 4 cm in a meter; measured with a Scout in the simulated room: 1 to 2
HEADING_RAD2_PER_M = 0.0004  # chosen: one degree in a meter; not measured: real floors are less even
HEADING_RAD2_PER_RAD = 0.006  # chosen: 4 degrees in one radian; measured with a Scout in the simulated room: 2 to 4
MOST_RAD2 = math.pi**2  # the heading is unknown


@dataclass(frozen=True, slots=True)
class Doubt:
    """Covariance of x, y and the heading h: square meters, meters times radians, square radians."""

    xx: float
    yy: float
    hh: float
    xy: float = 0.0
    xh: float = 0.0
    yh: float = 0.0

    @classmethod
    def of(cls, spread_m: float, spread_rad: float) -> Doubt:
        """Return the doubt of a pose with these standard deviations, the same in all directions."""
        return cls(spread_m**2, spread_m**2, min(MOST_RAD2, spread_rad**2))

    @property
    def spread_m(self) -> float:
        """Standard deviation of the place in the direction in which it is largest."""
        half, apart = (self.xx + self.yy) / 2, math.hypot((self.xx - self.yy) / 2, self.xy)
        return math.sqrt(max(0.0, half + apart))

    def moved(self, x_m: float, y_m: float, way_m: float, turned_rad: float) -> Doubt:
        """Return the doubt after a motion.

        Args:
            x_m: Displacement along x.
            y_m: Displacement along y.
            way_m: Length of the way, 0 or more.
            turned_rad: Size of the turn, 0 or more.
        """
        place = PLACE_M2_PER_M * way_m
        heading = HEADING_RAD2_PER_M * way_m + HEADING_RAD2_PER_RAD * turned_rad
        return Doubt(
            self.xx - 2 * y_m * self.xh + y_m * y_m * self.hh + place,
            self.yy + 2 * x_m * self.yh + x_m * x_m * self.hh + place,
            min(MOST_RAD2, self.hh + heading),
            self.xy - y_m * self.yh + x_m * self.xh - x_m * y_m * self.hh,
            self.xh - y_m * self.hh,
            self.yh + x_m * self.hh,
        )

    def larger(self, spread_m: float, spread_rad: float) -> Doubt:
        """Return the doubt after an unknown disturbance with these standard deviations."""
        return Doubt(
            self.xx + spread_m**2,
            self.yy + spread_m**2,
            min(MOST_RAD2, self.hh + spread_rad**2),
            self.xy,
            self.xh,
            self.yh,
        )
