"""Floor pick: computes the place on the floor at a point of a robot's picture. Pure.

The camera is a pinhole camera with square pixels, row 0 on top; an integer column or row is the middle of a pixel. The
floor is assumed flat, and the camera at the height and tilt that the kind of robot declares: on a ramp, or while the
robot accelerates, the result is displaced.

Source: Hartley and Zisserman, "Multiple View Geometry", chapter 6: intersection of a pixel's ray with a plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from backbone.component.abilities import CameraForm
from backbone.errors import Refusal

MOST_A_PIXEL_M = 0.25  # chosen: a finger covers several pixels; with a larger error the goal would be wrong


class NoFloorThere(Refusal):
    """No place on the floor can be determined for this point."""

    code = "console.no_floor_there"
    remedy = "Tap nearer to the lower edge of the picture, or tap the place on the map."


@dataclass(frozen=True, slots=True)
class Stand:
    """Pose of a robot at the time of its picture.

    Attributes:
        x_m: In the room's frame.
        y_m: Same.
        heading_rad: Counterclockwise from x.
    """

    x_m: float
    y_m: float
    heading_rad: float


def floor_place(
    column_px: float, row_px: float, size_px: tuple[int, int], camera: CameraForm, stand: Stand
) -> tuple[float, float]:
    """Return the place on the floor at this point of the picture: x and y in meters, in the room's frame.

    Args:
        column_px: 0: the middle of the leftmost pixel.
        row_px: 0: the middle of the uppermost pixel.
        size_px: Width and height of the picture.
        camera: Model of the robot's camera.
        stand: Pose of the robot.

    Raises:
        NoFloorThere: The point is above the horizon, or so near to it that a pixel is wider than ``MOST_A_PIXEL_M``.

    Example:
        >>> level = CameraForm(forward_m=0.0, height_m=1.0, tilt_rad=0.0, across_rad=math.pi / 2)
        >>> x_m, y_m = floor_place(50.0, 74.5, (101, 100), level, Stand(2.0, 1.0, 0.0))
        >>> round(x_m, 6), round(y_m, 6)
        (4.02, 1.0)
    """
    width_px, height_px = size_px
    focal_px = width_px / 2 / math.tan(camera.across_rad / 2)
    right = (column_px - (width_px - 1) / 2) / focal_px
    down = (row_px - (height_px - 1) / 2) / focal_px
    tilt_cos, tilt_sin = math.cos(camera.tilt_rad), math.sin(camera.tilt_rad)
    falls, goes = down * tilt_cos - tilt_sin, tilt_cos + down * tilt_sin  # direction of the ray, depth 1
    if falls <= 0.0:
        raise NoFloorThere("this point of the picture is above the horizon: no floor is there")
    depth_m = camera.height_m / falls
    pixel_m = depth_m / falls / focal_px
    if pixel_m > MOST_A_PIXEL_M:
        raise NoFloorThere(
            f"the floor there is about {depth_m * goes:.1f} m away, where a pixel of this picture is {pixel_m:.1f} m"
        )
    ahead_m, left_m = camera.forward_m + depth_m * goes, -depth_m * right
    turn_cos, turn_sin = math.cos(stand.heading_rad), math.sin(stand.heading_rad)
    return stand.x_m + ahead_m * turn_cos - left_m * turn_sin, stand.y_m + ahead_m * turn_sin + left_m * turn_cos
