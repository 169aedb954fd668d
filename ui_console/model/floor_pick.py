"""Floor pick: which place on the floor a point in a robot's picture shows. Pure.

The camera is a pinhole camera with square pixels, whose row 0 is on top; a column or row of a whole number is the
middle of its pixel. The floor is flat, and the robot stands on it as its kind declares: a ramp, or a robot that
accelerates, moves the place.

Source: Hartley and Zisserman, "Multiple View Geometry", chapter 6: the ray of a pixel, met with a plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from backbone.component.abilities import CameraForm
from backbone.errors import Refusal

MOST_A_PIXEL_M = 0.25  # chosen: a finger is pixels wide; a robot that stops so far beside is not where it was sent


class NoFloorThere(Refusal):
    """The point shows no place on the floor that can be told."""

    code = "console.no_floor_there"
    remedy = "Tap nearer to the lower edge of the picture, or tap the place on the map."


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a robot stood when its picture was taken.

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
    """Return the place on the floor that this point of the picture shows: x and y in meters, in the room's frame.

    Args:
        column_px: 0: the middle of the leftmost pixel.
        row_px: 0: the middle of the uppermost pixel.
        size_px: Width and height of the picture.
        camera: The robot's.
        stand: The robot's.

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
    falls, goes = down * tilt_cos - tilt_sin, tilt_cos + down * tilt_sin  # of a ray of depth 1
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
