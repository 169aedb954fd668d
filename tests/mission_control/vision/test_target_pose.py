"""Laws of the pose: what the camera sees says where the robot stands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from examples import share
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from landmark_pictures import polar

from mission_control.vision.landmark import Sighting
from mission_control.vision.pose_filter import REFUTATIONS, PoseFilter
from mission_control.vision.target_pose import TargetPose, discs_in_picture, estimate_poses, refine_pose

ranges_m = st.floats(0.45, 2.5)
off_axis_deg = st.floats(-45.0, 45.0)
bearings_deg = st.floats(-8.0, 8.0)
pitches_deg = st.floats(-3.0, 3.0)


def seen(pose: tuple[float, float, float], pitch_deg: float = 0.0, *, noise_px: float = 0.0, seed: int = 0) -> Sighting:
    """What a robot at this pose sees."""
    noise = np.random.default_rng(seed).normal(0.0, noise_px, (4, 2)) if noise_px else 0.0
    return Sighting(discs_in_picture(*pose, math.radians(pitch_deg)) + noise, 1.0)


def off_by(found: TargetPose, pose: tuple[float, float, float]) -> tuple[float, float]:
    """How far the pose found is from the true one: metres, radians."""
    return math.hypot(found.ahead_m - pose[0], found.left_m - pose[1]), abs(found.heading_rad - pose[2])


@given(range_m=ranges_m, off_axis=off_axis_deg, bearing=bearings_deg, pitch=pitches_deg)
def test_discs_without_noise_say_the_pose(range_m: float, off_axis: float, bearing: float, pitch: float) -> None:
    pose = polar(range_m, off_axis, bearing)
    found = estimate_poses(seen(pose, pitch))
    # The pitch is taken to be small, which weighs against the pixels of a target far away.
    assert min(off_by(each, pose)[0] for each in found) < 0.02 * range_m + 0.002
    assert min(off_by(each, pose)[1] for each in found) < math.radians(2.0)
    assert found[0].residual_px < 0.2


@settings(max_examples=share(50))
@given(range_m=ranges_m, off_axis=off_axis_deg, bearing=bearings_deg, seed=st.integers(0, 1000))
def test_a_mirrored_picture_is_seen_from_the_other_side(
    range_m: float, off_axis: float, bearing: float, seed: int
) -> None:
    sighting = seen(polar(range_m, off_axis, bearing), noise_px=0.2, seed=seed)
    mirrored = Sighting(sighting.blobs_px[[2, 1, 0, 3]] * [-1.0, 1.0] + [319.0, 0.0], 1.0)
    for here in estimate_poses(sighting):
        there = min(estimate_poses(mirrored), key=lambda pose: abs(pose.left_m + here.left_m))
        assert there.left_m == pytest.approx(-here.left_m, abs=0.005)
        assert there.ahead_m == pytest.approx(here.ahead_m, abs=0.005)
        assert there.heading_rad == pytest.approx(-here.heading_rad, abs=0.005)


@settings(max_examples=share(50))
@given(range_m=st.floats(0.45, 1.0), off_axis=off_axis_deg, bearing=bearings_deg, seed=st.integers(0, 1000))
def test_from_near_even_one_noisy_picture_says_the_pose(
    range_m: float, off_axis: float, bearing: float, seed: int
) -> None:
    pose = polar(range_m, off_axis, bearing)
    found = estimate_poses(seen(pose, noise_px=0.2, seed=seed))
    errors = [off_by(each, pose) for each in found]
    assert min(error_m for error_m, _ in errors) < 0.15 * range_m
    assert abs(found[0].range_m - range_m) < 0.05 * range_m
    assert abs(found[0].bearing_rad - math.radians(bearing)) < math.radians(1.0)


@settings(max_examples=share(50))
@given(range_m=ranges_m, off_axis=off_axis_deg, bearing=bearings_deg)
def test_range_angle_and_bearing_are_the_pose_in_other_words(range_m: float, off_axis: float, bearing: float) -> None:
    pose = TargetPose(*polar(range_m, off_axis, bearing), 0.0, 0.0, np.eye(4))
    assert pose.range_m == pytest.approx(range_m)
    assert pose.off_axis_rad == pytest.approx(math.radians(off_axis))
    assert pose.bearing_rad == pytest.approx(math.radians(bearing), abs=1e-9)


@given(
    forward_m=st.floats(-0.2, 0.2), turn_rad=st.floats(-0.5, 0.5), range_m=st.floats(0.5, 2.0), off_axis=off_axis_deg
)
def test_a_way_and_the_same_way_back_end_where_they_began(
    forward_m: float, turn_rad: float, range_m: float, off_axis: float
) -> None:
    pose = TargetPose(*polar(range_m, off_axis), 0.0, 0.0, np.eye(4))
    back = pose.moved(forward_m, turn_rad).moved(-forward_m, -turn_rad)
    assert off_by(back, (pose.ahead_m, pose.left_m, pose.heading_rad)) == pytest.approx((0.0, 0.0), abs=1e-9)


@settings(max_examples=share(50))
@given(range_m=ranges_m, off_axis=off_axis_deg, seed=st.integers(0, 1000))
def test_what_was_known_before_makes_a_pose_surer(range_m: float, off_axis: float, seed: int) -> None:
    pose = polar(range_m, off_axis)
    sighting = seen(pose, noise_px=0.2, seed=seed)
    alone = estimate_poses(sighting)[0]
    both = refine_pose(sighting, alone.moved(0.0, 0.0))
    assert both is not None
    assert (np.diag(both.covariance)[:3] < np.diag(alone.covariance)[:3]).all()
    assert np.linalg.eigvalsh(both.covariance).min() > 0


def test_who_looks_away_from_the_board_does_not_see_it() -> None:
    with pytest.raises(ValueError, match="not ahead"):
        discs_in_picture(1.0, 0.0, math.pi)


@settings(max_examples=share(15))
@given(
    range_m=st.floats(0.8, 2.3),
    off_axis=st.one_of(st.floats(-45.0, -15.0), st.floats(15.0, 45.0)),
    seed=st.integers(0, 1000),
)
def test_standing_still_for_a_second_tells_the_side_of_the_zero_angle_line(
    range_m: float, off_axis: float, seed: int
) -> None:
    pose = polar(range_m, off_axis)
    filtered, found = PoseFilter(), None
    for frame in range(30):
        filtered.moved(0.0, 0.0)
        found = filtered.saw(seen(pose, noise_px=0.12, seed=1000 * seed + frame)) or found
    assert found is not None
    assert found.left_m * pose[1] > 0
    assert abs(found.off_axis_rad - math.radians(off_axis)) < math.radians(10.0)


@settings(max_examples=share(6))
@given(off_axis=off_axis_deg, seed=st.integers(0, 1000), turn_rad_s=st.floats(-0.2, 0.2))
def test_driving_up_to_the_board_the_pose_gets_sure(off_axis: float, seed: int, turn_rad_s: float) -> None:
    pose = TargetPose(*polar(1.5, off_axis), 0.0, 0.0, np.eye(4))
    filtered, found = PoseFilter(), None
    for frame in range(120):
        turn_rad = turn_rad_s / 30 if abs(pose.bearing_rad + turn_rad_s / 30) < math.radians(10) else 0.0
        pose = pose.moved(0.2 / 30, turn_rad)
        filtered.moved(0.2 / 30, turn_rad)
        true = (pose.ahead_m, pose.left_m, pose.heading_rad)
        if pose.range_m < 0.5 or abs(pose.bearing_rad) > math.radians(12):
            break
        found = filtered.saw(seen(true, noise_px=0.15, seed=1000 * seed + frame))
    assume(pose.range_m < 0.9)
    assert found is not None
    assert off_by(found, true)[0] < 0.05
    assert off_by(found, true)[1] < math.radians(5.0)


def test_one_wrong_sighting_changes_nothing_and_many_on_end_do() -> None:
    here, there = polar(1.0, 20.0), polar(0.6, -30.0, 5.0)
    filtered = PoseFilter()
    for frame in range(10):
        filtered.saw(seen(here, noise_px=0.1, seed=frame))
    assert filtered.saw(seen(there)) is None
    again = filtered.saw(seen(here))
    assert again is not None
    assert off_by(again, here)[0] < 0.05
    answers = [filtered.saw(seen(there)) for _ in range(REFUTATIONS)]
    assert answers[:-1] == [None] * (REFUTATIONS - 1)
    assert answers[-1] is not None
    assert off_by(answers[-1], there)[0] < 0.02


def test_who_forgets_believes_the_next_sighting() -> None:
    filtered = PoseFilter()
    filtered.saw(seen(polar(1.0, 20.0)))
    filtered.forget()
    found = filtered.saw(seen(polar(0.6, -30.0)))
    assert found is not None
    assert off_by(found, polar(0.6, -30.0))[0] < 0.02


def test_four_points_that_no_board_on_the_floor_explains_are_no_sighting() -> None:
    upside_down = seen(polar(1.0, 0.0)).blobs_px * [1.0, -1.0] + [0.0, 239.0]
    assert PoseFilter().saw(Sighting(upside_down, 1.0)) is None
