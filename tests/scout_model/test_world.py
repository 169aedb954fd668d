import hashlib
import math
import subprocess
import sys

import msgspec
import mujoco
import numpy as np
import pytest

from scout_model import dimensions, radio_link
from scout_model.composition import model_of
from scout_model.description import CLEAN_AIR, Furniture, RobotPlace, Target, WorldDescription
from scout_model.errors import InvalidWorld, UnknownBody
from scout_model.scout import Spring
from scout_model.world import World

NORTH = math.pi / 2
EMPTY = WorldDescription(
    9.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 1.5, NORTH), RobotPlace("scout2", 2, 7.0, 1.5, 0)]
)


def drive(world: World, seconds: float, left_rad_s: float, right_rad_s: float, network_id: int = 1) -> None:
    """Let the Scout drive; like a radio, repeat the command."""
    for frame in range(round(seconds * dimensions.FRAMES_PER_S)):
        if frame % 6 == 0:
            world.hear(network_id, radio_link.encode_drive(left_rad_s, right_rad_s))
        world.step_frame()


def wait(world: World, seconds: float) -> None:
    for _ in range(round(seconds * dimensions.FRAMES_PER_S)):
        world.step_frame()


def way_m(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return math.dist(a[:2], b[:2])


def test_the_body_has_the_papers_mass_and_size() -> None:
    """RAM 2002: 11 cm long, 4 cm wide, approximately 200 g."""
    model = mujoco.MjModel.from_xml_string(World(EMPTY).mjcf)
    assert model.body("scout1/body").subtreemass[0] == pytest.approx(dimensions.BODY_MASS_KG)
    wheel = model.geom("scout1/left_tire").size
    assert 2 * wheel[0] == pytest.approx(dimensions.BODY_DIAMETER_M)
    across_m = model.body("scout1/left_wheel").pos[1] - model.body("scout1/right_wheel").pos[1]
    assert across_m == pytest.approx(dimensions.TRACK_M)
    assert across_m + 2 * wheel[1] == pytest.approx(dimensions.BODY_LENGTH_M)


def test_the_model_holds_the_numbers_of_dimensions() -> None:
    model = mujoco.MjModel.from_xml_string(World(EMPTY).mjcf)
    wheel, foot = model.actuator("scout1/left_wheel"), model.joint("scout1/foot")
    assert model.opt.timestep == pytest.approx(dimensions.STEP_S)
    frame_s = dimensions.STEP_S * dimensions.STEPS_PER_FRAME
    assert frame_s * dimensions.FRAMES_PER_S == pytest.approx(1.0)
    assert wheel.ctrlrange[1] == pytest.approx(dimensions.WHEEL_SPEED_LIMIT_RAD_S)
    assert wheel.forcerange[1] == pytest.approx(dimensions.WHEEL_TORQUE_LIMIT_N_M)
    assert model.geom("scout1/left_tire").friction[0] == pytest.approx(dimensions.WHEEL_FRICTION)
    assert foot.range[1] == pytest.approx(dimensions.FOOT_STROKE_M)
    assert math.atan2(-foot.axis[0], -foot.axis[2]) == pytest.approx(dimensions.FOOT_ANGLE_RAD, abs=1e-4)
    assert model.actuator("scout1/kick").gear[0] == pytest.approx(dimensions.FOOT_FORCE_N)
    camera = model.camera("scout1/camera")
    assert math.radians(camera.fovy[0]) == pytest.approx(dimensions.VERTICAL_VIEW_RAD, abs=1e-4)
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, camera.quat)
    assert math.asin(-axes[8]) == pytest.approx(dimensions.CAMERA_TILT_RAD, abs=1e-4)


def test_without_commands_nothing_moves() -> None:
    world = World(EMPTY)
    wait(world, 0.5)
    before = world.pose("scout1")
    wait(world, 3.0)
    assert way_m(before, world.pose("scout1")) < 1e-4
    assert world.transmitting() == {}


def test_it_drives_straight_at_the_speed_asked_for() -> None:
    world, speed_rad_s = World(EMPTY), 0.2 / dimensions.WHEEL_RADIUS_M
    drive(world, 1.0, speed_rad_s, speed_rad_s)
    before = world.pose("scout1")
    drive(world, 4.0, speed_rad_s, speed_rad_s)
    after = world.pose("scout1")
    assert after[1] - before[1] == pytest.approx(0.8, rel=0.02)
    assert after[0] == pytest.approx(before[0], abs=1e-3)
    assert world.wheel_speeds("scout1") == pytest.approx((speed_rad_s, speed_rad_s), rel=0.02)


@pytest.mark.parametrize(("slope_deg", "least_m_s", "most_m_s"), [(20.0, 0.15, 0.2), (24.0, -1.0, 0.0)])
def test_it_climbs_twenty_degrees_and_not_much_more(slope_deg: float, least_m_s: float, most_m_s: float) -> None:
    """IROS 2001, section 2: up to a 20 degree slope. A leaning gravity is a slope as long as one likes."""
    model = mujoco.MjModel.from_xml_string(World(EMPTY).mjcf)
    data, slope_rad = mujoco.MjData(model), math.radians(slope_deg)
    model.opt.gravity[:] = -9.81 * math.sin(slope_rad), 0.0, -9.81 * math.cos(slope_rad)
    for wheel in ("left_wheel", "right_wheel"):
        data.actuator(f"scout2/{wheel}").ctrl = 0.2 / dimensions.WHEEL_RADIUS_M
    mujoco.mj_step(model, data, nstep=240)
    begin_m = float(data.body("scout2/body").xpos[0])
    mujoco.mj_step(model, data, nstep=240)
    assert least_m_s < float(data.body("scout2/body").xpos[0]) - begin_m < most_m_s


def test_it_turns_on_the_spot() -> None:
    world = World(EMPTY)
    rim_rad_s = 1.0 * dimensions.TRACK_M / 2 / dimensions.WHEEL_RADIUS_M
    before = world.pose("scout1")
    drive(world, 2.0, -rim_rad_s, rim_rad_s)
    after = world.pose("scout1")
    assert (after[2] - before[2]) % (2 * math.pi) == pytest.approx(2.0, rel=0.05)
    assert way_m(before, after) < 0.005


def test_silence_stops_it_and_its_transmitter() -> None:
    world = World(EMPTY)
    world.hear(1, radio_link.encode_transmitter_on("video1"))
    drive(world, 1.0, 10.0, 10.0)
    assert world.transmitting() == {"scout1": "video1"}
    wait(world, dimensions.COMMAND_TIMEOUT_S + 0.3)
    assert world.transmitting() == {}
    assert world.wheel_speeds("scout1") == pytest.approx((0.0, 0.0), abs=0.05)


def test_a_packet_reaches_its_own_robot_and_no_other() -> None:
    world = World(EMPTY)
    wait(world, 0.5)
    other = world.pose("scout2")
    drive(world, 1.0, 10.0, 10.0)
    world.hear(77, radio_link.encode_drive(10.0, 10.0))
    world.hear(1, b"\xff\xff")
    assert way_m(other, world.pose("scout2")) < 1e-4


def test_it_jumps_over_thirty_centimetres_and_lands_on_its_wheels() -> None:
    """IROS 2001: capable of jumping over objects 30 cm in height."""
    world = World(EMPTY)
    wait(world, 0.5)
    world.hear(1, radio_link.encode_jump())
    heights_m = []
    for _ in range(120):
        world.hear(1, radio_link.encode_drive(0.0, 0.0))
        world.step_frame()
        heights_m.append(world.position_m("scout1")[2])
    apex_m = max(heights_m) - dimensions.WHEEL_RADIUS_M - dimensions.FOOT_STROKE_M
    assert apex_m > dimensions.JUMP_CLEARANCE_M
    assert world.spring("scout1") is Spring.WOUND
    before = world.pose("scout1")
    drive(world, 1.0, 10.0, 10.0)
    assert world.pose("scout1")[1] - before[1] > 0.15


def test_after_a_jump_it_is_on_the_other_side_of_the_box() -> None:
    """A box 30 cm high, 8 cm deep, 20 cm before the axle: the Scout is beyond it afterwards."""
    box = Furniture("box", x_m=2.0, y_m=1.74, width_m=0.6, depth_m=0.08, height_m=0.30)
    world = World(WorldDescription(9.0, 6.0, furniture=[box], robots=EMPTY.robots))
    wait(world, 0.5)
    world.hear(1, radio_link.encode_jump())
    for _ in range(60):
        world.hear(1, radio_link.encode_drive(0.0, 0.0))
        world.step_frame()
    _, y_m, z_m = world.position_m("scout1")
    assert y_m > 1.78
    assert z_m < 0.1


def test_walls_and_furniture_stop_it() -> None:
    crate = Furniture("crate", x_m=2.0, y_m=2.0, width_m=0.4, depth_m=0.4, height_m=0.3)
    world = World(WorldDescription(9.0, 6.0, furniture=[crate], robots=EMPTY.robots))
    drive(world, 4.0, 10.0, 10.0)
    assert world.pose("scout1")[1] < 1.80


def test_targets_keep_to_their_path_and_time() -> None:
    targets = [
        Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], speed_m_s=0.5),
        Target("person", "person", [(1.0, 5.0), (8.0, 5.0)], speed_m_s=1.0),
    ]
    world = World(WorldDescription(9.0, 6.0, targets=targets))
    wait(world, 2.0)
    assert world.time_s == 2.0
    assert world.pose("pioneer") == pytest.approx((1.0, 3.0, 0.0))
    assert world.pose("person") == pytest.approx((3.0, 5.0, 0.0))


def test_the_same_packets_give_the_same_states() -> None:
    hashes = set()
    for _ in range(2):
        world, digest = World(EMPTY), hashlib.sha256()
        for frame in range(90):
            if frame % 5 == 0:
                world.hear(1 + frame % 2, radio_link.encode_drive(frame / 10, 5.0))
            if frame == 30:
                world.hear(2, radio_link.encode_jump())
            world.step_frame()
            digest.update(world.state().tobytes())
        hashes.add(digest.hexdigest())
    assert len(hashes) == 1


def test_the_same_description_gives_the_same_model() -> None:
    assert World(EMPTY).mjcf == World(EMPTY).mjcf


@pytest.mark.parametrize(
    "question",
    [
        "pose",
        "position_m",
        "wheel_speeds",
        "spring",
        "motors",
        "is_asleep",
        "is_upright",
        "is_carried",
    ],
)
def test_an_unknown_body_is_refused_by_name(question: str) -> None:
    world = World(EMPTY)
    with pytest.raises(UnknownBody, match="'nobody'") as refusal:
        getattr(world, question)("nobody")
    assert isinstance(refusal.value, KeyError)


@pytest.mark.parametrize(
    "description",
    [
        WorldDescription(0.0, 6.0),
        WorldDescription(9.0, 6.0, robots=[RobotPlace("a", 1, 20.0, 1.0, 0.0)]),
        WorldDescription(9.0, 6.0, robots=[RobotPlace("a", 0, 1.0, 1.0, 0.0)]),
        WorldDescription(9.0, 6.0, robots=[RobotPlace("a", 1, 1.0, 1.0, 0.0), RobotPlace("b", 1, 2.0, 1.0, 0.0)]),
        WorldDescription(9.0, 6.0, robots=[RobotPlace("a", 1, 1.0, 1.0, 0.0), RobotPlace("a", 2, 2.0, 1.0, 0.0)]),
        WorldDescription(9.0, 6.0, robots=[RobotPlace("a/b", 1, 1.0, 1.0, 0.0)]),
        WorldDescription(9.0, 6.0, furniture=[Furniture("t", 1.0, 1.0, 0.0, 1.0, 1.0)]),
        WorldDescription(9.0, 6.0, furniture=[Furniture("t", 1.0, 1.0, 1e-14, 1.0, 1.0)]),
        WorldDescription(9.0, 6.0, targets=[Target("t", "elephant", [(0.0, 1.0), (1.0, 1.0)], 1.0)]),
        WorldDescription(9.0, 6.0, targets=[Target("t", "pioneer", [(0.0, 1.0), (0.0, 1.0)], 1.0)]),
        WorldDescription(9.0, 6.0, targets=[Target("t", "pioneer", [(0.0, 1.0), (1.0, 1.0)], 0.0)]),
    ],
)
def test_a_description_that_makes_no_sense_is_refused(description: WorldDescription) -> None:
    with pytest.raises(InvalidWorld):
        World(description)


@pytest.mark.processes
def test_the_world_needs_neither_opencv_nor_opengl() -> None:
    program = "import sys, scout_model.world; assert not {'cv2', 'OpenGL.GL', 'OpenGL.EGL'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_worlds_that_differ_in_air_and_later_departures_alone_have_one_model_and_other_rooms_another() -> None:
    target = Target("p", "pioneer", [(1.0, 3.0), (8.0, 3.0)], speed_m_s=0.5, begin_s=2.0)
    described = msgspec.structs.replace(EMPTY, targets=[target])
    other_air = msgspec.structs.replace(described, air=CLEAN_AIR)
    later = msgspec.structs.replace(described, targets=[msgspec.structs.replace(target, begin_s=9.0)])
    under_way = msgspec.structs.replace(described, targets=[msgspec.structs.replace(target, begin_s=-2.0)])
    mjcf = World(described).mjcf
    assert World(other_air).mjcf == World(later).mjcf == mjcf
    assert len({mjcf, World(under_way).mjcf, World(msgspec.structs.replace(described, seed=1)).mjcf}) == 3


def test_a_model_of_a_text_is_the_caller_s_own_and_the_same_for_all() -> None:
    text = World(EMPTY).mjcf
    one, fresh = model_of(text), mujoco.MjModel.from_xml_string(text)
    one.geom_rgba[:], one.opt.disableflags, one.opt.timestep = 0.0, 1, 1.0
    other = model_of(text)
    assert (other.opt.disableflags, other.opt.timestep) == (fresh.opt.disableflags, fresh.opt.timestep)
    for name in ("geom_rgba", "geom_pos", "body_mass", "dof_damping", "actuator_gainprm", "names", "qpos0"):
        assert np.array_equal(np.array(getattr(other, name)), np.array(getattr(fresh, name)))
