"""Laws of acquisition: the landmark is found wherever it can be, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from landmark_pictures import noisy, polar, shifted, view

from mission_control.vision.target_acquisition import acquire
from mission_control.vision.target_pose import discs_in_picture
from scout_model.camera import Camera
from scout_model.description import Furniture, RobotPlace, WorldDescription
from scout_model.video_link import Receiver
from scout_model.world import World


@settings(max_examples=share(40))
@given(
    range_m=st.floats(0.45, 2.5),
    off_axis=st.floats(-45.0, 45.0),
    bearing=st.floats(-8.0, 8.0),
    sigma=st.floats(0.0, 15.0),
    seed=st.integers(0, 1000),
)
def test_the_landmark_is_found_where_it_is(
    range_m: float, off_axis: float, bearing: float, sigma: float, seed: int
) -> None:
    pose = polar(range_m, off_axis, bearing)
    rng = np.random.default_rng(seed)
    found = [acquire(noisy(view(*pose), rng, sigma)) for _ in range(3)]
    sightings = [sighting for sighting in found if sighting is not None]
    assert sightings
    for sighting in sightings:
        assert np.abs(sighting.blobs_px - discs_in_picture(*pose)).max() < 1.5
        assert sighting.match >= 0.7


@settings(max_examples=share(25))
@given(columns=st.integers(-60, 60), rows=st.integers(-20, 20))
def test_a_moved_picture_has_its_landmark_moved_as_far(columns: int, rows: int) -> None:
    frame = view(1.2, 0.2, -0.1)
    here, there = acquire(frame), acquire(shifted(frame, columns, rows))
    assert here is not None
    assert there is not None
    assert np.allclose(there.blobs_px, here.blobs_px + np.array([columns, rows]))
    assert there.match == here.match


@pytest.mark.parametrize("heading_rad", np.linspace(-3.1, 3.1, 9).tolist())
def test_a_furnished_room_without_a_landmark_has_none(heading_rad: float) -> None:
    table = Furniture("table", 2.0, 2.0, 1.2, 0.8, 0.7)
    world = World(
        WorldDescription(5.0, 5.0, 3, furniture=[table], robots=[RobotPlace("scout", 1, 3.5, 3.0, heading_rad)])
    )
    with Camera(world.mjcf, "paint") as camera:
        assert acquire(camera.picture("scout")) is None


def test_snow_has_no_landmark() -> None:
    receiver = Receiver(5, "A")
    assert all(acquire(receiver.receive([], frame).picture) is None for frame in range(40))


@pytest.mark.parametrize("grey", [0, 61, 62, 63, 255])
def test_a_plain_picture_has_no_landmark(grey: int) -> None:
    assert acquire(np.full((240, 320), grey, np.uint8)) is None


def test_a_landmark_too_dark_for_the_threshold_or_too_pale_is_none() -> None:
    frame = view(1.0)
    assert acquire((frame * 0.3).astype(np.uint8)) is None
    assert acquire((frame * 0.3 + 150).astype(np.uint8)) is None


def test_only_grey_pictures_are_searched() -> None:
    with pytest.raises(ValueError, match="grey"):
        acquire(np.zeros((240, 320, 3), np.uint8))
    with pytest.raises(ValueError, match="bytes"):
        acquire(np.zeros((240, 320), np.float32))  # type: ignore[arg-type]
