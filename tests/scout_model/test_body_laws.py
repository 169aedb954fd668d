"""What the papers say of the Scout's body, and what physics says of any."""

import math
import random

import mujoco
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from scout_model import dimensions, radio_link
from scout_model.description import Furniture, Ramp, RobotPlace, WorldDescription
from scout_model.errors import UnknownBody
from scout_model.world import World

LIMIT_RAD_S = dimensions.WHEEL_SPEED_LIMIT_RAD_S
TOP_M_S = LIMIT_RAD_S * dimensions.WHEEL_RADIUS_M
GRAVITY_M_S2 = 9.81


def world(*furniture: Furniture, ramps: list[Ramp] | None = None, x_m: float = 2.0, heading_rad: float = 0.0) -> World:
    place = RobotPlace("scout1", 1, x_m, 3.0, heading_rad)
    return World(WorldDescription(9.0, 6.0, furniture=list(furniture), robots=[place], ramps=ramps or []))


def drive(room: World, frames: int, left_rad_s: float, right_rad_s: float) -> None:
    for frame in range(frames):
        if frame % 6 == 0:
            room.hear(1, radio_link.encode_drive(left_rad_s, right_rad_s))
        room.step_frame()


def wheels(forward_m_s: float, turn_rad_s: float) -> tuple[float, float]:
    rim_m_s = turn_rad_s * dimensions.TRACK_M / 2
    radius_m = dimensions.WHEEL_RADIUS_M
    return (forward_m_s - rim_m_s) / radius_m, (forward_m_s + rim_m_s) / radius_m


def on_a_slope(slope_deg: float) -> World:
    """A ramp of one metre up to a plateau, 15 cm ahead of a Scout."""
    height_m = math.tan(math.radians(slope_deg))
    ramp, plateau = Ramp("ramp", 2.65, 3.0, 1.0, 0.6, height_m), Furniture("plateau", 3.65, 3.0, 1.0, 0.6, height_m)
    return world(plateau, ramps=[ramp])


@pytest.mark.parametrize("slope_deg", [5.0, 10.0, 15.0, 20.0])
def test_it_climbs_a_smooth_slope_up_to_twenty_degrees(slope_deg: float) -> None:
    """IROS 2001, section 2; up at not much less than the speed asked for, and on at the top."""
    room = on_a_slope(slope_deg)
    drive(room, 240, *wheels(0.2, 0.0))
    x_m, y_m, z_m = room.position_m("scout1")
    assert x_m > 3.3
    assert y_m == pytest.approx(3.0, abs=0.02)
    assert z_m == pytest.approx(math.tan(math.radians(slope_deg)) + dimensions.WHEEL_RADIUS_M, abs=0.005)


@pytest.mark.parametrize("slope_deg", [22.0, 25.0, 30.0])
def test_it_slips_on_a_steeper_one(slope_deg: float) -> None:
    room = on_a_slope(slope_deg)
    drive(room, 300, *wheels(0.2, 0.0))
    assert room.position_m("scout1")[0] < 2.6


@given(st.floats(-0.3, 0.3), st.floats(-2.0, 2.0))
@settings(max_examples=share(20))
def test_it_drives_the_arc_that_its_wheels_describe(forward_m_s: float, turn_rad_s: float) -> None:
    room, (left, right) = world(x_m=4.5), wheels(forward_m_s, turn_rad_s)
    if max(abs(left), abs(right)) > LIMIT_RAD_S:
        return
    drive(room, 30, left, right)
    x_m, y_m, heading_rad = room.pose("scout1")
    drive(room, 30, left, right)
    there_x_m, there_y_m, there_rad = room.pose("scout1")
    turned_rad = math.remainder(there_rad - heading_rad, 2 * math.pi)
    assert turned_rad == pytest.approx(turn_rad_s, rel=0.05, abs=0.03)
    # The chord of the arc, in the direction of its middle.
    chord_m = forward_m_s * (math.sin(turn_rad_s / 2) / (turn_rad_s / 2) if abs(turn_rad_s) > 1e-6 else 1.0)
    middle_rad = heading_rad + turn_rad_s / 2
    assert there_x_m - x_m == pytest.approx(chord_m * math.cos(middle_rad), rel=0.05, abs=0.008)
    assert there_y_m - y_m == pytest.approx(chord_m * math.sin(middle_rad), rel=0.05, abs=0.008)


@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.integers(1, 20)), max_size=6))
@settings(max_examples=share(15))
def test_whatever_it_is_told_it_is_never_faster_than_its_wheels(told: list[tuple[float, float, int]]) -> None:
    room = world(x_m=4.5)
    drive(room, 30, 0.0, 0.0)
    begin = room.pose("scout1")
    for left_rad_s, right_rad_s, frames in told:
        drive(room, frames, left_rad_s, right_rad_s)
    # The body swings about its axle by a centimetre when its wheels start or stop.
    most_m = TOP_M_S * sum(frames for _, _, frames in told) / dimensions.FRAMES_PER_S + 0.01
    assert math.dist(begin[:2], room.pose("scout1")[:2]) <= most_m


def test_it_drives_up_no_step_higher_than_its_axle() -> None:
    room = world(Furniture("step", 2.6, 3.0, 0.5, 0.6, 0.03))
    drive(room, 120, *wheels(0.2, 0.0))
    assert room.position_m("scout1")[0] < 2.36


def test_it_drives_up_a_doorstep() -> None:
    room = world(Furniture("doorstep", 2.6, 3.0, 0.5, 0.6, 0.004))
    drive(room, 90, *wheels(0.2, 0.0))
    x_m, _, z_m = room.position_m("scout1")
    assert x_m > 2.4
    assert z_m == pytest.approx(dimensions.WHEEL_RADIUS_M + 0.004, abs=0.002)


@pytest.mark.parametrize("gap_m", [0.18, 0.24, 0.30])
def test_it_jumps_over_a_box_of_thirty_centimetres_lands_and_drives_on(gap_m: float) -> None:
    """IROS 2001, section 2: jumping over objects 30 cm in height."""
    room = world(Furniture("box", 2.0 + gap_m + 0.04, 3.0, 0.08, 0.8, 0.30))
    drive(room, 15, 0.0, 0.0)
    room.hear(1, radio_link.encode_jump())
    drive(room, 96, 0.0, 0.0)
    landed_m = room.position_m("scout1")
    assert landed_m[0] > 2.0 + gap_m + 0.08
    assert landed_m[2] < 0.05
    assert room.is_upright("scout1")
    drive(room, 30, *wheels(0.2, 0.0))
    assert room.position_m("scout1")[0] > landed_m[0] + 0.15


def test_it_does_not_jump_over_half_a_metre() -> None:
    room = world(Furniture("box", 2.24, 3.0, 0.08, 0.8, 0.55))
    drive(room, 15, 0.0, 0.0)
    room.hear(1, radio_link.encode_jump())
    drive(room, 96, 0.0, 0.0)
    assert room.position_m("scout1")[0] < 2.24


@pytest.mark.parametrize(("back", "forth"), [(6, 6), (9, 9), (12, 12), (7, 11), (11, 7)])
def test_back_and_forth_at_full_speed_puts_it_on_its_wheels_again(back: int, forth: int) -> None:
    """The wheelie: its tail throws it over. One that stands on its wheels is only shaken."""
    dice, fallen = random.Random(2), 0
    for _ in range(8):
        room = world(x_m=4.5)
        drive(room, 15, 0.0, 0.0)
        blow = (dice.uniform(-0.5, 0.5), dice.uniform(-0.5, 0.5), dice.uniform(0.8, 1.6))
        room.strike("scout1", blow, (dice.uniform(-6, 6), dice.uniform(-25, 25), dice.uniform(-3, 3)))
        drive(room, 75, 0.0, 0.0)
        fallen += not room.is_upright("scout1")
        drive(room, back, -LIMIT_RAD_S, -LIMIT_RAD_S)
        drive(room, forth, LIMIT_RAD_S, LIMIT_RAD_S)
        drive(room, 20, 0.0, 0.0)
        assert room.is_upright("scout1")
    assert fallen >= 2


def test_a_blow_that_is_no_number_or_hits_nobody_is_refused() -> None:
    room = world()
    with pytest.raises(ValueError, match="nan"):
        room.strike("scout1", (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(UnknownBody):
        room.strike("nobody", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def energies_j(model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> np.ndarray:
    """Motion, height and springs, the winch's rope among them, after each step."""
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    rope_n_m = float(model.actuator("scout1/winch").gainprm[0])
    foot = int(model.joint("scout1/foot").qposadr[0])
    energies = np.empty(steps)
    for step in range(steps):
        mujoco.mj_step(model, data)
        energies[step] = data.energy.sum() + rope_n_m * data.qpos[foot] ** 2 / 2
    return energies


def free_scout() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(world().mjcf)
    return model, mujoco.MjData(model)


@given(
    height_m=st.floats(0.0, 0.5),
    spin=st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-20, 20)),
)
@settings(max_examples=share(12))
def test_left_alone_it_gains_no_energy(height_m: float, spin: tuple[float, float, float]) -> None:
    model, data = free_scout()
    data.joint("scout1/free").qpos[2] += height_m
    data.joint("scout1/free").qvel[3:] = spin
    energies = energies_j(model, data, 480)
    highest_gain_j = (energies - np.minimum.accumulate(energies)).max()
    # What a contact gives back within its few steps of compression counts as spring energy it took before.
    assert highest_gain_j < 0.02 + 0.05 * (energies[0] - energies[-1])
    assert energies[-1] <= energies[0]


def test_a_jump_is_no_higher_than_the_work_of_its_spring() -> None:
    room = world()
    drive(room, 15, 0.0, 0.0)
    standing_m = room.position_m("scout1")[2]
    room.hear(1, radio_link.encode_jump())
    apex_m = 0.0
    for _ in range(60):
        drive(room, 1, 0.0, 0.0)
        apex_m = max(apex_m, room.position_m("scout1")[2])
    work_j = dimensions.FOOT_FORCE_N * (dimensions.FOOT_STROKE_M - dimensions.FOOT_PRELOAD_M)
    height_j = dimensions.BODY_MASS_KG * GRAVITY_M_S2 * (apex_m - standing_m)
    assert 0.6 * work_j < height_j < work_j


def test_climbing_takes_no_less_than_the_height_gained_is_worth() -> None:
    room = on_a_slope(20.0)
    drive(room, 90, *wheels(0.2, 0.0))
    before_m = room.position_m("scout1")[2]
    drive(room, 30, *wheels(0.2, 0.0))
    gained_w = dimensions.BODY_MASS_KG * GRAVITY_M_S2 * (room.position_m("scout1")[2] - before_m)
    torque_w = 2 * dimensions.WHEEL_TORQUE_LIMIT_N_M * sum(room.wheel_speeds("scout1")) / 2
    assert 0 < gained_w < torque_w
