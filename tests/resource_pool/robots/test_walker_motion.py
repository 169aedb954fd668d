"""Inverse kinematics and motion control: the joints bring the feet where the gait wants them."""

from __future__ import annotations

import math

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from resource_pool.robots.walker.gait import LEGS, STANDING, TROT, WALK, Feet, Foot, Gait, GaitParameters, TrunkSpeed
from resource_pool.robots.walker.kinematics import TOLERANCE_M, Kinematics
from resource_pool.robots.walker.link import JOINTS, Angles
from resource_pool.robots.walker.motion import LONGEST_STEP_S, STEP_S, MotionControl

RANGES_RAD = (0.6, 1.1, 1.1)  # body.xml: abduction, hip, knee
moves = st.builds(TrunkSpeed, st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))
gaits = st.sampled_from([TROT, WALK]) | st.builds(
    GaitParameters,
    **{name: st.floats(*limits) for name, limits in GaitParameters.RANGES.items()},
    phases=st.tuples(*[st.floats(0.0, 1.0, exclude_max=True)] * 4),
)


def foot_at(leg: int, joints_rad: Angles) -> Foot:
    """Return where a foot is: the closed form, from the lengths in body.xml."""
    abduction_rad, hip_rad, knee_rad = joints_rad[3 * leg : 3 * leg + 3]
    ahead, left = (1, 1, -1, -1)[leg], (1, -1, 1, -1)[leg]
    thigh_rad = math.atan2(-0.045 * ahead, 0.06) - hip_rad
    shank_rad = math.atan2(0.045 * ahead, 0.06) - hip_rad - knee_rad
    forward_m = 0.075 * (math.sin(thigh_rad) + math.sin(shank_rad))
    down_m = 0.075 * (math.cos(thigh_rad) + math.cos(shank_rad))
    out_m = 0.03 * left
    return (
        0.085 * ahead + forward_m,
        0.05 * left + out_m * math.cos(abduction_rad) + down_m * math.sin(abduction_rad),
        out_m * math.sin(abduction_rad) - down_m * math.cos(abduction_rad),
    )


def farthest_m(feet: Feet, joints_rad: Angles) -> float:
    return max(math.dist(foot, foot_at(leg, joints_rad)) for leg, foot in enumerate(feet))


def assert_legal(joints_rad: Angles) -> None:
    for joint, angle_rad in zip(JOINTS, joints_rad, strict=True):
        limit_rad = RANGES_RAD[("abduction", "hip", "knee").index(joint.rpartition("_")[2])]
        assert abs(angle_rad) <= limit_rad + 1e-6, joint


def test_standing_is_all_joints_at_zero() -> None:
    assert foot_at(0, (0.0,) * 12) == pytest.approx(STANDING[0])
    assert Kinematics().joints(STANDING) == pytest.approx((0.0,) * 12, abs=1e-9)


@settings(max_examples=share(15))
@given(gaits, st.lists(moves, min_size=1, max_size=3))
def test_the_joints_bring_the_feet_of_every_gait_where_they_shall_be(
    parameters: GaitParameters, asked: list[TrunkSpeed]
) -> None:
    gait, kinematics = Gait(parameters), Kinematics()
    for move in asked:
        gait.request(move)
        for _ in range(40):
            feet = gait.advance(STEP_S)
            joints_rad = kinematics.joints(feet)
            assert farthest_m(feet, joints_rad) <= 2 * TOLERANCE_M
            assert_legal(joints_rad)


def test_a_foot_out_of_reach_gets_a_legal_posture_and_comes_back() -> None:
    kinematics = Kinematics()
    x_m, y_m, _ = STANDING[0]
    far: Feet = ((x_m + 0.3, y_m + 0.2, -0.3), *STANDING[1:])
    for _ in range(20):
        assert_legal(kinematics.joints(far))
    for _ in range(20):
        joints_rad = kinematics.joints(STANDING)
    assert joints_rad == pytest.approx((0.0,) * 12, abs=0.005)


def test_the_same_requests_give_the_same_targets() -> None:
    def targets() -> list[Angles]:
        control = MotionControl()
        found = []
        for step in range(200):
            if step % 40 == 0:
                control.request(TrunkSpeed(0.3 - 0.002 * step, 0.01 * step))
            found.append(control.step(step * STEP_S))
        return found

    assert targets() == targets()


def test_its_state_says_what_it_does() -> None:
    control = MotionControl()
    state = control.state()
    assert state.is_resting
    assert (state.commanded, state.expected) == (TrunkSpeed(), TrunkSpeed())
    control.request(TrunkSpeed(1.0, 0.0))
    for step in range(101):
        joints_rad = control.step(10.0 + step * STEP_S)
    state = control.state()
    assert not state.is_resting
    assert state.commanded == state.expected == TrunkSpeed(0.3, 0.0)
    assert state.joints_rad == joints_rad
    # Two seconds at 0.3 m/s, less half of the 0.375 s in which it gathers speed.
    assert state.x_m == pytest.approx(0.3 * (2.0 - 0.375 / 2), abs=0.01)
    assert (state.y_m, state.heading_rad) == (0.0, 0.0)
    assert state.phase == pytest.approx(2.0 / TROT.period_s % 1.0, abs=1e-6)


def test_dead_reckoning_of_a_full_turn_ends_where_it_began() -> None:
    control = MotionControl()
    control.request(TrunkSpeed(0.2, 1.0))
    began_s = control_until(control, 0.0, 1.0)
    before = control.state()
    control_until(control, began_s, began_s + math.tau)
    after = control.state()
    assert after.heading_rad - before.heading_rad == pytest.approx(math.tau, abs=0.03)
    assert (after.x_m, after.y_m) == pytest.approx((before.x_m, before.y_m), abs=0.01)


def control_until(control: MotionControl, now_s: float, end_s: float) -> float:
    while now_s < end_s:
        now_s += STEP_S
        control.step(now_s)
    return now_s


def test_a_control_that_was_held_up_does_not_leap() -> None:
    held_up, on_time = MotionControl(), MotionControl()
    for control in (held_up, on_time):
        control.request(TrunkSpeed(0.3))
        control_until(control, 0.0, 1.0)
    assert held_up.step(61.0) == pytest.approx(on_time.step(1.0 + LONGEST_STEP_S), abs=1e-9)


@settings(max_examples=share(15))
@given(moves, st.integers(0, 60))
def test_a_control_that_rests_begins_anew_from_the_standing_posture(move: TrunkSpeed, steps: int) -> None:
    rested, new = MotionControl(), MotionControl()
    rested.request(move)
    for step in range(steps):
        rested.step(step * STEP_S)
    way = rested.state()
    rested.rest()
    state = rested.state()
    assert state.is_resting
    assert state.joints_rad == pytest.approx((0.0,) * 12, abs=0.005)
    assert (state.x_m, state.y_m, state.heading_rad) == (way.x_m, way.y_m, way.heading_rad)
    for control in (rested, new):
        control.request(TrunkSpeed(0.3))
    for step in range(20):
        now_s = 100.0 + step * STEP_S
        assert rested.step(now_s) == pytest.approx(new.step(now_s), abs=0.005)


def test_legs_and_joints_have_one_order() -> None:
    assert [joint.rpartition("_")[0] for joint in JOINTS[::3]] == list(LEGS)
