"""Where the robot stands before the landmark, from the middles of its four discs.

Frame: origin on the floor under the middle of the board.  The zero-angle line leaves the board at a
right angle; ``ahead_m`` is measured along it.  A robot on it that faces the board has heading 0.

Source: RAM 2002, "Visual Servoing": the robot shall reach a point on the zero-angle line of the target.
Method: chosen; planar Gauss-Newton fit of position, heading and pitch.  Three of the four discs lie on
a line, which makes the usual homography useless, but a robot on a floor has only these four unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mission_control.vision.landmark import Floats


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A pinhole camera on a robot.

    Attributes:
        focal_px: Focal length in pixels.
        centre_px: Column and row of the optical axis.
        height_m: Above the floor.
        forward_m: Before the middle of the axle.
        tilt_rad: Upwards.
    """

    focal_px: float
    centre_px: tuple[float, float]
    height_m: float
    forward_m: float
    tilt_rad: float


SCOUT_CAMERA = CameraModel(
    focal_px=160 / math.tan(math.radians(20.0)),
    centre_px=(159.5, 119.5),
    height_m=0.026,
    forward_m=0.019,
    tilt_rad=math.radians(4.0),
)
"""The Scout's, at 320 × 240 pixels; a test holds it to the simulated one."""


@dataclass(frozen=True, slots=True, eq=False)
class TargetPose:
    """Where the middle of the robot's axle is, and how sure that is.

    Attributes:
        ahead_m: Before the board.
        left_m: Left of the zero-angle line, seen by who faces the board.
        heading_rad: 0 faces the board squarely, counter-clockwise is positive.
        pitch_rad: How much the camera looks higher than its tilt says.
        residual_px: Root mean square of what the fit leaves of the eight coordinates.
        covariance: Of (ahead, left, heading, pitch), shape (4, 4).
    """

    ahead_m: float
    left_m: float
    heading_rad: float
    pitch_rad: float
    residual_px: float
    covariance: Floats

    @property
    def range_m(self) -> float:
        """Distance of the axle from the middle of the board."""
        return math.hypot(self.ahead_m, self.left_m)

    @property
    def off_axis_rad(self) -> float:
        """Angle at the board between the zero-angle line and the robot, positive on the left."""
        return math.atan2(self.left_m, self.ahead_m)

    @property
    def bearing_rad(self) -> float:
        """Where the middle of the board is, seen from the axle: 0 straight ahead, positive to the left."""
        return _wrapped(-self.off_axis_rad - self.heading_rad)


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, math.tau)
