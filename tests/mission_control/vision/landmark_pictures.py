"""Pictures of the landmark for tests, as the simulated Scout's camera sees it."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from scout_model.camera import Camera
from scout_model.description import Landmark, RobotPlace, WorldDescription
from scout_model.world import World

Picture = NDArray[np.uint8]
BOARD = Landmark("home", 5.5, 4.0, math.pi)


def world_with_landmark(ahead_m: float, left_m: float, heading_rad: float) -> World:
    """A Scout at this pose before the board, frame as in ``target_pose``."""
    place = RobotPlace("scout", 1, BOARD.x_m - ahead_m, BOARD.y_m + left_m, heading_rad)
    return World(WorldDescription(6.0, 8.0, seed=1, robots=[place], landmarks=[BOARD]))


@lru_cache(maxsize=256)
def view(ahead_m: float, left_m: float = 0.0, heading_rad: float = 0.0) -> Picture:
    """What the Scout sees from there, its body level."""
    world = world_with_landmark(ahead_m, left_m, heading_rad)
    with Camera(world.mjcf, "paint") as camera:
        camera.show(world.state())
        picture = camera.picture("scout")
    picture.flags.writeable = False
    return picture


def polar(range_m: float, off_axis_deg: float, bearing_deg: float = 0.0) -> tuple[float, float, float]:
    """A pose (ahead, left, heading) from distance, angle off the zero-angle line, and where the board is seen."""
    off_axis_rad = math.radians(off_axis_deg)
    return (
        range_m * math.cos(off_axis_rad),
        range_m * math.sin(off_axis_rad),
        -off_axis_rad - math.radians(bearing_deg),
    )


def noisy(picture: Picture, rng: np.random.Generator, sigma: float) -> Picture:
    """The picture with white noise."""
    return np.clip(picture + rng.normal(0.0, sigma, picture.shape), 0, 255).astype(np.uint8)


def shifted(picture: Picture, columns: int, rows: int) -> Picture:
    """The picture moved to the right and down; the edge pixels are repeated."""
    height, width = picture.shape
    return picture[
        np.clip(np.arange(height) - rows, 0, height - 1)[:, np.newaxis],
        np.clip(np.arange(width) - columns, 0, width - 1)[np.newaxis],
    ]
