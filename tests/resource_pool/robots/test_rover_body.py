"""The rover in the simulated world: it drives, feels, stops at what it touches, and carries."""

import math

import mujoco
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from resource_pool.robots.rover import body, link
from resource_pool.robots.rover.link import Bumpers, GripPacket, MovePacket, RoverReply
from scout_model import radio_link
from scout_model.description import Furniture, RobotPlace, Target, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.radio_link import HaltPacket, TransmitterOff, TransmitterOn
from scout_model.world import STATE, World

ROVER = "resource_pool.robots.rover.body:Rover"
FREE = Bumpers(front=False, left_tip=False, right_tip=False, rear=False)
AHEAD_M = 0.29  # from the axle to the tips of the paddles
BOX_ON_THE_FLOOR = (
    '<body name="box" pos="2.6 3.01 0.04"><freejoint/><geom type="box" size="0.03 0.03 0.04" mass="0.2"/></body>'
)
LOAD_ON_THE_DECK = (
    '<body name="box" pos="1.96 3 0.27"><freejoint/><geom type="box" size="0.1 0.1 0.05" mass="20"/></body>'
)


def world(*furniture: Furniture, x_m: float = 2.0, heading_rad: float = 0.0, thing: str = "") -> World:
    places = [RobotPlace("rover1", 1, x_m, 3.0, heading_rad, ROVER), RobotPlace("scout1", 2, 7.0, 5.0, 0.0)]
    room = f'<mujoco><worldbody><geom type="plane" size="0 0 1"/>{thing}</worldbody></mujoco>' if thing else ""
    return World(WorldDescription(9.0, 6.0, furniture=list(furniture), robots=places, mjcf=room))


def go(room: World, seconds: float, *packets: link.Packet) -> None:
    """Let time pass; like a radio, repeat the packets."""
    for frame in range(round(seconds * FRAMES_PER_S)):
        if frame % 6 == 0:
            for packet in packets:
                room.hear(1, link.encode(packet))
        room.step_frame()


def told(room: World) -> RoverReply:
    room.hear(1, link.encode(TransmitterOff()))
    return link.decode_reply(room.reply(1))


def place_of_the_box_m(room: World) -> tuple[float, float, float]:
    model = mujoco.MjModel.from_xml_string(room.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, room.state(), STATE)
    mujoco.mj_kinematics(model, data)
    x_m, y_m, z_m = data.body("room/box").xpos
    return float(x_m), float(y_m), float(z_m)


def test_the_body_has_the_data_sheets_size_and_mass() -> None:
    model = mujoco.MjModel.from_xml_string(world().mjcf)
    assert model.body("rover1/body").subtreemass[0] == pytest.approx(9.0)
    front, rear, deck = (model.geom(f"rover1/{name}") for name in ("front_bumper", "rear_bumper", "deck"))
    assert front.pos[0] + front.size[0] - rear.pos[0] + rear.size[0] == pytest.approx(0.44)
    assert 2 * deck.size[1] == pytest.approx(0.38)
    assert model.body("rover1/body").pos[2] + deck.pos[2] + deck.size[2] == pytest.approx(0.22)


def test_the_model_holds_the_numbers_of_the_program() -> None:
    model = mujoco.MjModel.from_xml_string(world().mjcf)
    left, right = model.body("rover1/left_wheel"), model.body("rover1/right_wheel")
    assert left.pos[1] - right.pos[1] == pytest.approx(body.TRACK_M)
    assert model.geom("rover1/left_tire").size[0] == pytest.approx(body.WHEEL_RADIUS_M)
    assert model.actuator("rover1/left_wheel").forcerange[1] == pytest.approx(body.TORQUE_LIMIT_N_M)
    assert model.joint("rover1/left_paddle").range[1] == pytest.approx(body.PADDLES_M)
    assert model.joint("rover1/lift").range[1] == pytest.approx(body.LIFT_M)
    proof = model.joint("rover1/proof_left")
    assert proof.stiffness[0] / model.body("rover1/proof_mass").mass[0] == pytest.approx(body.SPRINGS_S2)
    for number, heading_deg in enumerate((90, 50, 30, 10, -10, -30, -50, -90)):
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, model.site(f"rover1/sonar_{number}").quat)
        assert math.degrees(math.atan2(axes[5], axes[2])) == pytest.approx(heading_deg, abs=1e-3)


def test_it_drives_straight_as_far_as_its_encoders_say_and_sleeps_when_it_stands() -> None:
    room = world()
    go(room, 2.0, MovePacket(0.5, 0.0))
    before, odometer = room.pose("rover1"), told(room)
    go(room, 4.0, MovePacket(0.5, 0.0))
    after = room.pose("rover1")
    assert after[0] - before[0] == pytest.approx(2.0, rel=0.01)
    assert (after[1], after[2]) == pytest.approx((3.0, 0.0), abs=1e-3)
    assert told(room).left_m - odometer.left_m == pytest.approx(2.0, rel=0.01)
    assert told(room).right_m - odometer.right_m == pytest.approx(2.0, rel=0.01)
    go(room, 3.0, HaltPacket())
    assert room.is_asleep("rover1")


@pytest.mark.parametrize("turn_rad_s", [-2.0, -0.5, 1.0, 2.6])
def test_it_turns_on_the_spot(turn_rad_s: float) -> None:
    room = world()
    go(room, 1.0, MovePacket(0.0, turn_rad_s))
    before = room.pose("rover1")
    go(room, 0.5, MovePacket(0.0, turn_rad_s))
    after = room.pose("rover1")
    assert math.remainder(after[2] - before[2], 2 * math.pi) == pytest.approx(turn_rad_s / 2, rel=0.05)
    assert math.dist(before[:2], after[:2]) < 0.01


@given(st.floats(-0.6, 0.6), st.floats(-1.5, 1.5))
@settings(max_examples=share(10))
def test_it_drives_the_arc_that_was_asked_for(forward_m_s: float, turn_rad_s: float) -> None:
    room = world(x_m=4.5)
    go(room, 1.0, MovePacket(forward_m_s, turn_rad_s))
    x_m, y_m, heading_rad = room.pose("rover1")
    go(room, 1.0, MovePacket(forward_m_s, turn_rad_s))
    there_x_m, there_y_m, there_rad = room.pose("rover1")
    assert math.remainder(there_rad - heading_rad, 2 * math.pi) == pytest.approx(turn_rad_s, rel=0.05, abs=0.02)
    chord_m = forward_m_s * (math.sin(turn_rad_s / 2) / (turn_rad_s / 2) if abs(turn_rad_s) > 1e-6 else 1.0)
    middle_rad = heading_rad + turn_rad_s / 2
    assert there_x_m - x_m == pytest.approx(chord_m * math.cos(middle_rad), rel=0.05, abs=0.02)
    assert there_y_m - y_m == pytest.approx(chord_m * math.sin(middle_rad), rel=0.05, abs=0.02)


def test_with_twenty_kilograms_on_its_deck_it_drives_and_loses_nothing() -> None:
    room = world(thing=LOAD_ON_THE_DECK)
    go(room, 3.0, MovePacket(0.5, 0.0))
    go(room, 1.0, HaltPacket())
    x_m, y_m, z_m = place_of_the_box_m(room)
    assert room.pose("rover1")[0] > 3.2
    assert x_m == pytest.approx(room.pose("rover1")[0] - 0.04, abs=0.02)
    assert (y_m, z_m) == pytest.approx((3.0, 0.27), abs=0.01)


def test_the_same_packets_give_the_same_state() -> None:
    states = []
    for _ in range(2):
        room = world(Furniture("box", 4.0, 3.0, 0.3, 0.6, 0.3))
        go(room, 3.0, MovePacket(1.0, 0.1), GripPacket(0.5, 0.5))
        go(room, 1.0, MovePacket(-0.5, 1.0))
        states.append(room.state().tobytes())
    assert states[0] == states[1]


@pytest.mark.parametrize("to_the_wall_m", [3.0, 1.2, 0.4])
def test_each_sonar_measures_the_way_to_the_wall_it_looks_at(to_the_wall_m: float) -> None:
    room = world(x_m=9.0 - to_the_wall_m)
    go(room, 1.0)
    expected_cm = []
    for x_m, y_m, heading_deg in ((0.075, 0.130, 90), (0.115, 0.115, 50), (0.150, 0.080, 30), (0.170, 0.025, 10)):
        along, across = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
        ways_m = [(3.0 - y_m) / across, (to_the_wall_m - x_m) / along if heading_deg < 90 else math.inf]
        expected_cm.append(min(500.0, 100 * min(ways_m)))
    assert told(room).sonars_cm == pytest.approx((*expected_cm, *reversed(expected_cm)), abs=1.5)


def test_asleep_it_sees_who_comes_and_goes() -> None:
    description = WorldDescription(
        9.0,
        6.0,
        robots=[RobotPlace("rover1", 1, 2.0, 3.0, 0.0, ROVER)],
        targets=[Target("pioneer", "pioneer", [(4.0, 0.5), (4.0, 5.5)], 0.5, begin_s=2.0)],
    )
    room, nearest_cm = World(description), []
    for _ in range(14 * FRAMES_PER_S):
        room.step_frame()
        nearest_cm.append(min(told(room).sonars_cm[3:5]))
    assert room.is_asleep("rover1")
    assert nearest_cm[60] == nearest_cm[-1] == 500
    assert min(nearest_cm) == pytest.approx(100 * (2.0 - 0.17 - 0.20), abs=5)


def test_the_gyroscope_reads_how_fast_it_turns_and_nothing_when_it_stands() -> None:
    room = world()
    go(room, 2.0, MovePacket(0.0, 1.0))
    turned = [told(room).gyroscope_rad_s[2]]
    for _ in range(15):
        go(room, 1 / FRAMES_PER_S, MovePacket(0.0, 1.0))
        turned.append(told(room).gyroscope_rad_s[2])
    assert turned == pytest.approx([1.0] * 16, rel=0.05)
    go(room, 2.0, HaltPacket())
    assert told(room).gyroscope_rad_s == pytest.approx((0.0, 0.0, 0.0), abs=0.005)


def test_the_accelerometer_reads_speeding_up_braking_and_the_pull_of_a_curve() -> None:
    room = world(x_m=1.5)
    go(room, 1.0)
    felt = []
    for _ in range(20):
        go(room, 1 / FRAMES_PER_S, MovePacket(1.5, 0.0))
        felt.append(told(room).acceleration_m_s2[0])
    assert sum(felt[5:]) / 15 == pytest.approx(body.ACCELERATION_M_S2, rel=0.1)
    go(room, 1.0, MovePacket(0.8, 1.0))
    go(room, 0.5, MovePacket(0.8, 1.0))
    curve = told(room).acceleration_m_s2
    assert curve == pytest.approx((0.0, 0.8 * 1.0), abs=0.08)
    go(room, 2.0, HaltPacket())
    assert told(room).acceleration_m_s2 == pytest.approx((0.0, 0.0), abs=0.05)


@pytest.mark.parametrize("speed_m_s", [0.2, 0.5, 1.5])
def test_a_wall_presses_its_bumpers_and_stops_it_until_it_backs_off(speed_m_s: float) -> None:
    room, edge_m = world(x_m=7.0), 9.0
    pressed = []
    for _ in range(round(2.5 / speed_m_s * FRAMES_PER_S) + 60):
        go(room, 1 / FRAMES_PER_S, MovePacket(speed_m_s, 0.0))
        reply = told(room)
        pressed.append(reply.bumpers.left_tip and reply.bumpers.right_tip)
    assert any(pressed)
    assert told(room).is_blocked
    assert room.pose("rover1")[0] == pytest.approx(edge_m - AHEAD_M, abs=0.01)
    assert room.is_upright("rover1")
    assert room.motors("rover1") == 0.0
    go(room, 2.0, MovePacket(-0.3, 0.0))
    assert room.pose("rover1")[0] < edge_m - AHEAD_M - 0.4
    assert not told(room).is_blocked


def test_what_is_beside_the_gripper_presses_the_bumper_behind_it() -> None:
    room = world(Furniture("leg", 4.0, 3.145, 0.02, 0.02, 0.3))
    go(room, 7.0, MovePacket(0.3, 0.0))
    assert told(room).is_blocked
    assert told(room).bumpers.front
    go(room, 3.0, MovePacket(0.3, 0.0))
    assert room.pose("rover1")[0] == pytest.approx(4.0 - 0.01 - 0.18, abs=0.02)


def test_backing_into_a_wall_presses_the_rear_bumper_only() -> None:
    room, pressed = world(x_m=1.0), set()
    for _ in range(120):
        go(room, 1 / FRAMES_PER_S, MovePacket(-0.3, 0.0))
        pressed.add(told(room).bumpers)
    assert pressed == {FREE, Bumpers(front=False, left_tip=False, right_tip=False, rear=True)}
    assert room.pose("rover1")[0] == pytest.approx(0.26, abs=0.01)


def test_it_grips_a_box_lifts_it_carries_it_and_sets_it_down() -> None:
    room = world(thing=BOX_ON_THE_FLOOR)
    go(room, 2.0, MovePacket(0.18, 0.0))
    go(room, 3.0, GripPacket(1.0, 0.0), HaltPacket())
    assert told(room).is_holding
    assert told(room).closed == pytest.approx((0.21 / 2 - 0.03) / body.PADDLES_M, abs=0.05)
    go(room, 5.0, GripPacket(1.0, 0.8))
    assert place_of_the_box_m(room)[2] == pytest.approx(0.04 + 0.8 * body.LIFT_M, abs=0.005)
    go(room, 2.0, MovePacket(-0.5, 0.0))
    go(room, 2.0, MovePacket(0.3, 1.5))
    go(room, 2.0)  # silence: the wheels stop, the grip stays
    x_m, y_m, z_m = place_of_the_box_m(room)
    assert z_m > 0.11
    assert math.dist((x_m, y_m), room.pose("rover1")[:2]) == pytest.approx(0.25, abs=0.02)
    assert (told(room).is_holding, told(room).is_blocked, told(room).bumpers) == (True, False, FREE)
    go(room, 5.0, GripPacket(1.0, 0.0))
    go(room, 3.0, GripPacket(0.0, 0.0))
    assert not told(room).is_holding
    go(room, 2.0, MovePacket(-0.3, 0.0))
    assert place_of_the_box_m(room) == pytest.approx((x_m, y_m, 0.04), abs=0.01)


def test_an_empty_gripper_closes_lifts_and_holds_nothing() -> None:
    room = world()
    go(room, 6.0, GripPacket(1.0, 1.0))
    assert (told(room).closed, told(room).lift) == pytest.approx((1.0, 1.0), abs=0.04)
    assert not told(room).is_holding
    assert told(room).sonars_cm[3:5] == (500, 500)


def test_beside_a_scout_each_hears_its_own_packets_and_answers_in_its_own_words() -> None:
    room = world()
    for frame in range(60):
        if frame % 6 == 0:
            room.hear(1, link.encode(MovePacket(0.5, 0.0)))
            room.hear(1, link.encode(TransmitterOn("video1")))
            room.hear(2, radio_link.encode_drive(5.0, 5.0))
        room.step_frame()
    assert room.transmitting() == {"rover1": "video1"}
    assert room.motors("rover1") == pytest.approx(0.5 / body.TOP_M_S)
    assert link.decode_reply(room.reply(1)).left_m > 0.5
    assert radio_link.decode_reply(room.reply(2)).battery > 0.99
    assert (room.reply(1), room.reply(2)) == (b"", b"")
