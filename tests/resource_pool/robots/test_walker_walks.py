"""In MuJoCo the walker walks straight ahead, round a curve and on the spot, and does not fall."""

from __future__ import annotations

import math

import pytest
from walker_trials import WALKER, Pilot, Trial, walk

from resource_pool.robots.walker import link
from resource_pool.robots.walker.gait import WALK, TrunkSpeed
from scout_model import radio_link
from scout_model.camera import Camera
from scout_model.description import RobotPlace, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.world import World

ONE_SEED = [7]
TWENTY_SEEDS = [pytest.param(seed, marks=pytest.mark.slow) for seed in range(100, 120)]
SEEDS = [*ONE_SEED, *TWENTY_SEEDS]


@pytest.mark.parametrize("seed", SEEDS)
def test_it_walks_a_straight_line(seed: int) -> None:
    walked = walk(TrunkSpeed(0.3), 6.5, seed)
    assert not walked.fell
    assert walked.forward_m > 1.5
    assert abs(walked.aside_rad) < math.radians(15.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_it_walks_a_curve(seed: int) -> None:
    """Half a circle of a third of a metre: it ends two radii to the left."""
    walked = walk(TrunkSpeed(0.2, 0.6), math.pi / 0.6, seed)
    assert not walked.fell
    assert walked.turned_rad == pytest.approx(math.pi, rel=0.15)
    assert (walked.forward_m, walked.left_m) == pytest.approx((0.0, 2 * 0.2 / 0.6), abs=0.2)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("turn_rad_s", [1.2, -1.2])
def test_it_turns_on_the_spot(seed: int, turn_rad_s: float) -> None:
    walked = walk(TrunkSpeed(0.0, turn_rad_s), 3.0, seed)
    assert not walked.fell
    assert math.copysign(walked.turned_rad, walked.turned_rad * turn_rad_s) > math.pi
    assert math.hypot(walked.forward_m, walked.left_m) < 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_it_walks_steadily_with_one_foot_in_the_air(seed: int) -> None:
    walked = walk(TrunkSpeed(0.1), 5.0, seed, WALK)
    assert walked.tilt_rad < math.radians(6.0)
    assert walked.forward_m > 0.45


@pytest.mark.parametrize("seed", TWENTY_SEEDS)
def test_no_change_of_the_request_makes_it_fall(seed: int) -> None:
    trial, pilot = Trial(seed), Pilot()
    for step in range(20):
        forward_m_s, turn_rad_s = (0.3, -0.3, 0.0, 0.15, 0.0)[(seed + step) % 5], (0.0, 1.8, -1.8)[step % 3]
        pilot.control.request(TrunkSpeed(forward_m_s, turn_rad_s))
        assert not trial.walk(pilot, 0.7).fell


def test_without_disturbance_it_goes_where_its_odometry_says() -> None:
    trial, pilot = Trial(), Pilot()
    pilot.control.request(TrunkSpeed(0.3, 0.3))
    walked, state = trial.walk(pilot, 4.0), pilot.control.state()
    assert (walked.forward_m, walked.left_m) == pytest.approx((state.x_m, state.y_m), abs=0.15)
    assert walked.turned_rad == pytest.approx(state.heading_rad, abs=0.3)


def test_its_replies_say_how_it_stands() -> None:
    trial, pilot = Trial(7), Pilot()
    pilot.control.request(TrunkSpeed(0.3))
    walked = trial.walk(pilot, 4.0)
    assert walked.felt_wrong_rad < 2 * link.ANGLE_RAD
    assert max(abs(status.pitch_rad) for status in walked.statuses) > math.radians(0.5)
    contacts = {sum(status.on_floor) for status in walked.statuses[30:]}
    assert contacts >= {2, 4}
    charges = [status.battery for status in walked.statuses]
    assert charges == sorted(charges, reverse=True)
    assert charges[-1] > 0.99
    lag_rad = [
        abs(measured - target)
        for measured, target in zip(walked.statuses[-1].joints_rad, pilot.control.state().joints_rad, strict=True)
    ]
    assert max(lag_rad) < 0.5


def test_silence_in_the_middle_of_a_stride_lets_it_stand() -> None:
    """The pilot of the second part sends nothing: the board stands the walker up and it stays upright."""
    trial, pilot = Trial(), Pilot()
    pilot.control.request(TrunkSpeed(0.3, 0.5))
    trial.walk(pilot, 1.9)
    silent = Pilot()
    silent.packets = lambda now_s: []  # type: ignore[method-assign]
    walked = trial.walk(silent, 2.0)
    assert not walked.fell
    status = walked.statuses[-1]
    assert max(map(abs, status.joints_rad)) < 0.05
    assert all(status.on_floor)
    assert abs(walked.forward_m) < 0.35


def test_in_a_world_it_walks_beside_a_scout_and_sleeps_when_it_stands() -> None:
    places = [RobotPlace("walker1", 1, 3.0, 3.0, 0.0, WALKER), RobotPlace("scout1", 2, 3.0, 4.0, 0.0)]
    room, pilot = World(WorldDescription(9.0, 6.0, robots=places)), Pilot()
    pilot.control.request(TrunkSpeed(0.3))
    room.hear(1, radio_link.encode_transmitter_on("video1"))
    for frame in range(3 * FRAMES_PER_S):
        for packet in pilot.packets(room.time_s):
            room.hear(1, packet)
        if frame % 5 == 0:
            room.hear(2, radio_link.encode_drive(10.0, 10.0))
        room.step_frame()
    x_m, y_m, _ = room.pose("walker1")
    assert x_m > 3.6
    assert y_m == pytest.approx(3.0, abs=0.2)
    assert room.pose("scout1")[0] > 3.3
    assert room.motors("walker1") > 0.05
    assert room.transmitting() == {"walker1": "video1"}
    room.hear(1, radio_link.encode_safe())
    for _ in range(3 * FRAMES_PER_S):
        room.step_frame()
    assert room.is_upright("walker1")
    assert room.is_asleep("walker1")
    assert room.motors("walker1") == 0.0
    assert room.transmitting() == {}


def test_its_camera_sees_the_room_from_its_head() -> None:
    places = [RobotPlace("walker1", 1, 3.0, 3.0, 0.0, WALKER), RobotPlace("scout1", 2, 4.0, 3.0, 0.0)]
    with Camera(World(WorldDescription(9.0, 6.0, robots=places)).mjcf, "paint") as camera:
        assert camera.picture("walker1").std() > 10


def test_a_foot_on_the_floor_is_reported_and_one_in_the_air_is_not() -> None:
    trial, pilot = Trial(), Pilot()
    still = trial.walk(pilot, 1.0)
    assert still.statuses[-1].on_floor == (True,) * 4
    assert link.decode_status(trial.walker.reply(1.0)).joints_rad == still.statuses[-1].joints_rad
    trial.data.qpos[2] += 0.5
    fallen = trial.walk(pilot, 0.1)
    assert fallen.statuses[-1].on_floor == (False,) * 4
