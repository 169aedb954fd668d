"""A point in a robot's picture is a place on the floor, or a sentence why it is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from backbone.component.abilities import CameraForm
from resource_pool.rcs.scout import Scout
from resource_pool.robots.rover.rc import RoverRc
from resource_pool.robots.walker.rc import WalkerRc
from scout_model.camera import Camera
from scout_model.description import Furniture, RobotPlace, WorldDescription
from scout_model.world import World
from ui_console.model.floor_pick import MOST_A_PIXEL_M, NoFloorThere, Stand, floor_place

SIZE = (320, 240)
FOCAL_PX = 160 / math.tan(math.radians(20.0))
HIGH = CameraForm(forward_m=0.1, height_m=0.2, tilt_rad=math.radians(4.0), across_rad=math.radians(40.0))
KINDS = {
    "scout": (Scout, "scout_model.scout:Scout"),
    "rover": (RoverRc, "resource_pool.robots.rover.body:Rover"),
    "walker": (WalkerRc, "resource_pool.robots.walker.body:Walker"),
}


def seen_at(ahead_m: float, left_m: float, camera: CameraForm) -> tuple[float, float]:
    """Return column and row of a place on the floor, in the frame of a robot that stands at 0, 0 and looks along x."""
    depth_m, tilt_rad = ahead_m - camera.forward_m, camera.tilt_rad
    along_m = depth_m * math.cos(tilt_rad) - camera.height_m * math.sin(tilt_rad)
    below_m = depth_m * math.sin(tilt_rad) + camera.height_m * math.cos(tilt_rad)
    return 159.5 - FOCAL_PX * left_m / along_m, 119.5 + FOCAL_PX * below_m / along_m


@given(st.floats(0.9, 3.5), st.floats(-0.3, 0.3), st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7))
def test_what_the_camera_sees_there_is_picked_there(
    ahead_m: float, left_m: float, x_m: float, y_m: float, turn_rad: float
) -> None:
    column_px, row_px = seen_at(ahead_m, left_m, HIGH)
    found = floor_place(column_px, row_px, SIZE, HIGH, Stand(x_m, y_m, turn_rad))
    there_x_m = x_m + ahead_m * math.cos(turn_rad) - left_m * math.sin(turn_rad)
    there_y_m = y_m + ahead_m * math.sin(turn_rad) + left_m * math.cos(turn_rad)
    assert found == pytest.approx((there_x_m, there_y_m), abs=1e-6)


@given(st.floats(-0.5, 319.5), st.floats(-0.5, 239.5))
def test_a_point_is_a_place_before_the_robot_or_is_refused_with_a_sentence(column_px: float, row_px: float) -> None:
    horizon_px = 119.5 + FOCAL_PX * math.tan(HIGH.tilt_rad)
    try:
        x_m, _y_m = floor_place(column_px, row_px, SIZE, HIGH, Stand(0.0, 0.0, 0.0))
    except NoFloorThere as refusal:
        x_m, why = math.inf, refusal.detail
    else:
        why = ""
    assert ("horizon" in why) is (row_px <= horizon_px)
    assert x_m > HIGH.forward_m
    too_far_px = horizon_px + math.sqrt(HIGH.height_m / MOST_A_PIXEL_M * FOCAL_PX) + 1
    assert not why or row_px < too_far_px


def test_above_the_horizon_and_right_below_it_there_is_no_floor() -> None:
    stand = Stand(0.0, 0.0, 0.0)
    with pytest.raises(NoFloorThere, match="above the horizon") as refused:
        floor_place(160, 40, SIZE, HIGH, stand)
    assert "map" in refused.value.remedy
    with pytest.raises(NoFloorThere, match="a pixel of this picture is"):
        floor_place(160, 152, SIZE, HIGH, stand)


@pytest.mark.parametrize("kind", KINDS)
def test_the_camera_that_a_robot_declares_is_that_of_its_body_at_rest(kind: str) -> None:
    rc, body = KINDS[kind]
    camera = rc.abilities().camera
    assert camera is not None
    _picture, world, cameras = picture_of(body, [])
    x_m, y_m, _heading_rad = world.pose("one")
    at_x_m, at_y_m, at_z_m = cameras.position_m("one")
    assert math.hypot(at_x_m - x_m, at_y_m - y_m) == pytest.approx(camera.forward_m, abs=2e-3)
    assert at_z_m == pytest.approx(camera.height_m, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_the_lower_edge_of_a_thing_in_a_real_picture_is_picked_where_it_stands(kind: str) -> None:
    rc, body = KINDS[kind]
    camera = rc.abilities().camera
    assert camera is not None
    empty, world, _cameras = picture_of(body, [])
    near_m, left_m = 3.0 + camera.forward_m + 4.0 * camera.height_m + 0.35, 4.05
    with_box, *_ = picture_of(body, [Furniture("box", near_m + 0.1, left_m, 0.2, 0.06, 0.15)])
    rows, columns = np.nonzero(empty != with_box)
    point = float(columns[rows == rows.max()].mean()), float(rows.max()) + 0.5
    found = floor_place(*point, SIZE, camera, Stand(*world.pose("one")))
    assert math.dist(found, (near_m, left_m)) < 0.04


def picture_of(body: str, furniture: list[Furniture]) -> tuple[NDArray[np.uint8], World, Camera]:
    """Return what a robot at 3, 4 sees that looks along x, once it is at rest."""
    place = RobotPlace("one", 1, 3.0, 4.0, 0.0, kind=body)
    world = World(WorldDescription(width_m=8.0, depth_m=8.0, robots=[place], furniture=furniture))
    for _frame in range(60):
        world.step_frame()
    cameras = Camera(world.mjcf, "paint")
    cameras.show(world.state())
    return cameras.picture("one"), world, cameras
