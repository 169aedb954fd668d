"""The servo board: it arrives in time, never too fast, and stands when nobody speaks to it."""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.walker import link
from resource_pool.robots.walker.body import SERVO_SPEED_LIMIT_RAD_S, Walker
from resource_pool.robots.walker.gait import HIP_X_M, LEGS, STANDING_HEIGHT_M, TRACK_Y_M
from resource_pool.robots.walker.link import JOINTS, Angles, JointTargets
from scout_model import radio_link
from scout_model.dimensions import COMMAND_TIMEOUT_S, FRAMES_PER_S
from scout_model.robot import Robot, robot_class

targets = st.lists(st.floats(-1.1, 1.1), min_size=12, max_size=12).map(tuple)
AWAY: Angles = (0.1,) * 12
LEVEL = (1.0, 0.0, 0.0, 0.0)


def test_it_is_a_kind_of_robot() -> None:
    assert robot_class("resource_pool.robots.walker.body:Walker") is Walker
    assert isinstance(Walker(), Robot)


def test_its_body_has_the_joints_servos_and_sensors_of_its_program() -> None:
    model = mujoco.MjModel.from_xml_string(Walker.body_mjcf())
    assert [model.actuator(number).name for number in range(model.nu)] == list(JOINTS)
    for number in range(model.nu):
        servo = model.actuator(number)
        assert servo.ctrllimited
        assert servo.forcelimited
        assert model.joint(servo.trnid[0]).name == servo.name
        assert (servo.ctrlrange == model.joint(servo.trnid[0]).range).all()
    sensors = {model.sensor(number).name for number in range(model.nsensor)}
    assert sensors == {"gyro", "attitude", *JOINTS, *(f"{leg}_foot" for leg in LEGS)}
    assert 1.5 < model.body("body").subtreemass[0] < 2.5


def test_its_body_has_the_lengths_of_its_gait() -> None:
    model = mujoco.MjModel.from_xml_string(Walker.body_mjcf())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    foot_m = data.site("front_left_foot").xpos - data.body("body").xpos
    assert foot_m == pytest.approx((HIP_X_M, TRACK_Y_M, -STANDING_HEIGHT_M))
    assert data.site("front_left_foot").xpos[2] == pytest.approx(model.geom("front_left_foot").size[0])


def ticks(walker: Walker, first: int, count: int) -> list[Angles]:
    return [tuple(walker.controls(tick / FRAMES_PER_S).values()) for tick in range(first, first + count)]


@given(st.lists(st.tuples(targets, st.floats(0.0, 0.3), st.integers(1, 12)), min_size=1, max_size=5))
def test_no_packet_moves_a_servo_faster_than_it_can(script: list[tuple[Angles, float, int]]) -> None:
    walker, driven, tick = Walker(), [(0.0,) * 12], 0
    for targets_rad, within_s, count in script:
        walker.hear(link.encode_joint_targets(JointTargets(targets_rad, within_s)), tick / FRAMES_PER_S)
        driven += ticks(walker, tick, count)
        tick += count
    most_rad = SERVO_SPEED_LIMIT_RAD_S / FRAMES_PER_S + 1e-9
    for before, after in pairwise(driven):
        assert max(abs(one - other) for one, other in zip(before, after, strict=True)) <= most_rad
    assert 0.0 <= walker.motors <= 1.0


@given(targets)
def test_it_arrives_when_it_shall_evenly(targets_rad: Angles) -> None:
    walker = Walker()
    walker.hear(link.encode_joint_targets(JointTargets(targets_rad, 0.2)), 0.0)
    driven = ticks(walker, 0, 6)
    assert driven[-1] == pytest.approx(targets_rad, abs=1e-4)
    assert driven[2] == pytest.approx([angle / 2 for angle in targets_rad], abs=1e-3)


@pytest.mark.parametrize("packet", [radio_link.encode_halt(), radio_link.encode_safe(), None])
def test_halt_safe_and_silence_let_it_stand(packet: bytes | None) -> None:
    walker = Walker()
    walker.hear(link.encode_joint_targets(JointTargets(AWAY, 0.0)), 0.0)
    assert ticks(walker, 0, 3)[-1] == pytest.approx(AWAY)
    silent = int(COMMAND_TIMEOUT_S * FRAMES_PER_S)
    if packet is not None:
        walker.hear(packet, 0.1)
        silent = 3
    driven = ticks(walker, 3, silent + 12)
    assert driven[-1] == (0.0,) * 12
    assert walker.motors == 0.0


def test_it_holds_its_targets_until_silence_is_long_enough() -> None:
    walker = Walker()
    walker.hear(link.encode_joint_targets(JointTargets(AWAY, 0.0)), 0.0)
    assert ticks(walker, 0, int(COMMAND_TIMEOUT_S * FRAMES_PER_S))[-1] == pytest.approx(AWAY)


def test_its_transmitter_obeys_and_goes_off_with_safe_and_silence() -> None:
    walker = Walker()
    walker.hear(radio_link.encode_transmitter_on("video1"), 0.0)
    assert walker.frequency == "video1"
    walker.hear(radio_link.encode_transmitter_off(), 0.1)
    assert walker.frequency == ""
    walker.hear(radio_link.encode_transmitter_on("video2"), 0.2)
    walker.hear(radio_link.encode_safe(), 0.3)
    assert walker.frequency == ""
    walker.hear(radio_link.encode_transmitter_on("video3"), 0.4)
    walker.controls(0.4 + COMMAND_TIMEOUT_S)
    assert walker.frequency == ""


def test_malformed_packets_do_not_feed_the_watchdog() -> None:
    walker = Walker()
    walker.hear(link.encode_joint_targets(JointTargets(AWAY, 0.0)), 0.0)
    for tick in range(30):
        walker.hear(b"noise", tick / FRAMES_PER_S)
        driven = walker.controls(tick / FRAMES_PER_S)
    assert set(driven.values()) == {0.0}


def readings(attitude: tuple[float, float, float, float], turn_rad_s: float = 0.0) -> dict[str, list[float]]:
    still = {joint: [0.01 * number] for number, joint in enumerate(JOINTS)}
    feet = {f"{leg}_foot": [float(number % 2)] for number, leg in enumerate(LEGS)}
    return {"gyro": [0.0, 0.0, turn_rad_s], "attitude": list(attitude), **still, **feet}


def test_it_replies_nothing_before_it_has_felt_anything() -> None:
    assert Walker().reply(0.0) == b""


def test_its_reply_says_what_it_felt() -> None:
    walker = Walker()
    walker.feel(readings(LEVEL), 0.0)
    walker.feel(readings((math.cos(0.25), math.sin(0.25), 0.0, 0.0), 1.5), 0.1)
    status = link.decode_status(walker.reply(0.1))
    assert status.battery == 1.0
    assert (status.roll_rad, status.pitch_rad, status.turn_rad_s) == pytest.approx((0.5, 0.0, 1.5), abs=1e-4)
    assert status.joints_rad == pytest.approx([0.01 * number for number in range(12)])
    assert status.on_floor == (False, True, False, True)


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_its_tilt_does_not_depend_on_its_heading(heading_rad: float, pitch_rad: float, roll_rad: float) -> None:
    """Turned to its heading, then nose down, then to the right."""
    turned, pitched, both, rolled = (np.empty(4) for _ in range(4))
    mujoco.mju_axisAngle2Quat(turned, np.array([0.0, 0.0, 1.0]), heading_rad)
    mujoco.mju_axisAngle2Quat(pitched, np.array([0.0, 1.0, 0.0]), pitch_rad)
    mujoco.mju_axisAngle2Quat(rolled, np.array([1.0, 0.0, 0.0]), roll_rad)
    mujoco.mju_mulQuat(both, turned, pitched)
    attitude = np.empty(4)
    mujoco.mju_mulQuat(attitude, both, rolled)
    walker = Walker()
    walker.feel(readings(tuple(attitude.tolist())), 0.0)
    status = link.decode_status(walker.reply(0.0))
    assert (status.roll_rad, status.pitch_rad) == pytest.approx((roll_rad, pitch_rad), abs=2e-4)


def test_its_battery_empties_faster_when_it_moves() -> None:
    standing, moving = Walker(), Walker()
    for tick in range(20 * 60 * FRAMES_PER_S):
        now_s = tick / FRAMES_PER_S
        if tick % 3 == 0:
            moving.hear(link.encode_joint_targets(JointTargets(AWAY if tick % 2 else (0.0,) * 12, 0.1)), now_s)
        for walker in (standing, moving):
            walker.controls(now_s)
    for walker in (standing, moving):
        walker.feel(readings(LEVEL), 1200.0)
    left = [link.decode_status(walker.reply(1200.0)).battery for walker in (standing, moving)]
    assert 0.9 < left[0] < 1.0
    assert left[1] < left[0]
