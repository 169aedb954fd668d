"""A robot feels the sensors of its body and answers on the digital link, if its class has the methods for it."""

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model import dimensions, radio_link
from scout_model.battery import Battery
from scout_model.description import RobotPlace, WorldDescription
from scout_model.errors import InvalidWorld
from scout_model.inclinometer import SMOOTHING_S, Inclinometer
from scout_model.robot import AnsweringRobot, FeelingRobot, PoweredRobot, Robot
from scout_model.scout import Scout, Spring
from scout_model.world import World

FRAME_S = 1 / dimensions.FRAMES_PER_S


class Feeler:
    """A box with sensors that notes what it feels."""

    felt: list[tuple[float, dict[str, list[float]]]] = []  # of the one feeler of a test's world

    def __init__(self) -> None:
        self.felt.clear()

    @classmethod
    def body_mjcf(cls) -> str:
        return """
        <mujoco model="feeler">
          <worldbody>
            <body name="body" pos="0 0 0.1" sleep="allowed">
              <freejoint name="free"/>
              <geom type="box" size="0.1 0.1 0.1" mass="1"/>
              <site name="middle"/>
              <site name="ahead" zaxis="1 0 0"/>
            </body>
          </worldbody>
          <sensor>
            <accelerometer name="pull" site="middle"/>
            <rangefinder name="ray" site="ahead" cutoff="5"/>
          </sensor>
        </mujoco>
        """

    @property
    def frequency(self) -> str:
        return ""

    @property
    def motors(self) -> float:
        return 0.0

    def hear(self, payload: bytes, now_s: float) -> None:
        pass

    def controls(self, now_s: float) -> dict[str, float]:
        return {}

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:
        self.felt.append((now_s, {name: list(reading) for name, reading in readings.items()}))


class Wrapped:
    """A Scout in a wrapper, which passes all calls on."""

    body_mjcf = Scout.body_mjcf
    frequency, motors = property(lambda self: self.of.frequency), property(lambda self: self.of.motors)

    def __init__(self) -> None:
        self.of = Scout()

    def __getattr__(self, word: str) -> Any:
        return getattr(self.of, word)

    def hear(self, payload: bytes, now_s: float) -> None:
        self.of.hear(payload, now_s)

    def controls(self, now_s: float) -> Mapping[str, float]:
        return self.of.controls(now_s)


@pytest.fixture(autouse=True)
def _robots_can_be_imported(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    yield
    sys.modules.pop("rover", None)


def wait(room: World, seconds: float, *payloads: bytes) -> None:
    for _ in range(round(seconds * dimensions.FRAMES_PER_S)):
        for payload in payloads:
            room.hear(1, payload)
        room.step_frame()


def told(room: World) -> radio_link.ScoutReply:
    room.hear(1, radio_link.encode_transmitter_off())
    return radio_link.decode_reply(room.reply(1))


def scouts(*more: RobotPlace) -> World:
    return World(WorldDescription(9.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 3.0, 0.0), *more]))


def feelers() -> World:
    places = [RobotPlace("a", 1, 5.0, 3.0, 0.0), RobotPlace("b", 2, 3.0, 3.0, 0.0, f"{__name__}:Feeler")]
    return World(WorldDescription(9.0, 6.0, robots=places))


def test_a_robot_feels_the_sensors_of_its_own_body_by_their_names_there() -> None:
    room = feelers()
    wait(room, 1.0)
    assert all(set(readings) == {"pull", "ray"} for _, readings in Feeler.felt)
    _, newest = Feeler.felt[-1]
    assert newest["pull"] == pytest.approx([0.0, 0.0, 9.81], abs=0.05)
    assert newest["ray"] == pytest.approx([5.0])  # over the Scout, to the wall six metres away


def test_it_feels_from_the_beginning_once_a_frame_and_not_while_all_stays_the_same() -> None:
    room = feelers()
    assert [now_s for now_s, _ in Feeler.felt] == [0.0]
    room.strike("b", (0.0, 0.0, 2.0), (0.0, 1.0, 0.0))
    wait(room, 0.2)
    assert [now_s for now_s, _ in Feeler.felt] == pytest.approx([frame * FRAME_S for frame in range(7)])
    wait(room, 3.0)
    assert room.is_asleep("b")
    felt = len(Feeler.felt)
    wait(room, 2.0)
    assert len(Feeler.felt) == felt
    room.strike("b", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0))
    room.step_frame()
    assert len(Feeler.felt) == felt + 1


def test_who_feels_changes_no_motion() -> None:
    """Sensors are computed once a frame or not at all; physics must not know."""
    states = []
    for kind in ("rover:Rover", f"{__name__}:Feeler"):
        room = scouts(RobotPlace("far", 2, 8.0, 5.0, 0.0, kind))
        wait(room, 3.0, radio_link.encode_drive(9.0, 7.0))
        states.append((room.position_m("scout1"), room.pose("scout1")))
    assert states[0] == states[1]


def test_only_robots_with_the_methods_feel_and_answer() -> None:
    assert isinstance(Scout(), FeelingRobot)
    assert isinstance(Scout(), AnsweringRobot)
    assert isinstance(Feeler(), Robot)
    assert not isinstance(Feeler(), AnsweringRobot)
    room = scouts(RobotPlace("rover1", 2, 8.0, 5.0, 0.0, "rover:Rover"))
    room.hear(2, radio_link.encode_halt())
    assert room.reply(2) == b""
    assert room.reply(77) == b""


def test_a_robot_feels_and_answers_through_a_program_that_passes_calls_on() -> None:
    room = scouts(RobotPlace("wrapped", 2, 8.0, 5.0, 0.0, f"{__name__}:Wrapped"))
    for network_id in (1, 2):
        room.hear(network_id, radio_link.encode_drive(9.0, 9.0))
    for _ in range(30):
        room.step_frame()
    assert room.reply(2) == room.reply(1) != b""


def test_a_scout_answers_once_what_it_heard_and_not_what_was_noise() -> None:
    room = scouts()
    assert room.reply(1) == b""
    room.hear(1, b"noise")
    assert room.reply(1) == b""
    room.hear(1, radio_link.encode_halt())
    assert radio_link.decode_reply(room.reply(1)).battery == 1.0
    assert room.reply(1) == b""


def test_it_tells_upright_from_fallen_also_when_it_sleeps() -> None:
    room = scouts()
    wait(room, 3.0)
    assert room.is_asleep("scout1")
    assert told(room).tilt_rad < math.radians(10)
    room.strike("scout1", (0.0, 0.0, 1.2), (0.0, -20.0, 0.0))
    wait(room, 4.0)
    assert not room.is_upright("scout1")
    assert room.is_asleep("scout1")
    assert told(room).tilt_rad > math.radians(120)


def test_its_motors_work_hard_against_a_wall_and_hardly_when_it_rolls() -> None:
    room, drive = scouts(), radio_link.encode_drive(10.0, 10.0)
    wait(room, 2.0, drive)
    rolling = told(room).load
    room = World(WorldDescription(9.0, 6.0, robots=[RobotPlace("scout1", 1, 8.9, 3.0, 0.0)]))
    wait(room, 2.0, drive)
    assert told(room).load > 3 * rolling
    wait(room, 2.0)
    assert told(room).load < 0.05


def powered(share: float) -> Scout:
    scout = Scout()
    scout.battery = Battery(10.0, share)
    return scout


def run(scout: Scout, begin_s: float, seconds: float, *payloads: bytes) -> dict[str, float]:
    controls: dict[str, float] = {}
    for frame in range(round(seconds * dimensions.FRAMES_PER_S)):
        now_s = begin_s + frame * FRAME_S
        for payload in payloads:
            scout.hear(payload, now_s)
        controls = scout.controls(now_s)
    return controls


def test_an_empty_battery_stops_its_wheels_transmitter_and_answers() -> None:
    scout = powered(1.0)
    payloads = radio_link.encode_drive(5.0, 5.0), radio_link.encode_transmitter_on("video1")
    lasts_s = 10.0 / (dimensions.IDLE_W + dimensions.TRANSMITTER_W)
    assert run(scout, 0.0, lasts_s - 0.5, *payloads)["left_wheel"] == 5.0
    assert scout.frequency == "video1"
    assert radio_link.decode_reply(scout.reply(lasts_s - 0.5)).battery == pytest.approx(0.07, abs=0.02)
    assert run(scout, lasts_s - 0.5, 1.0, *payloads) == {
        "left_wheel": 0.0,
        "right_wheel": 0.0,
        "kick": 0.0,
        "winch": 0.0,
    }
    assert scout.frequency == ""
    scout.hear(payloads[0], lasts_s + 1.0)
    assert scout.reply(lasts_s + 1.0) == b""
    assert scout.motors == 0.0


def test_an_empty_battery_leaves_the_winch_where_it_is() -> None:
    scout = powered(1.0)
    scout.battery = Battery(dimensions.IDLE_W * 1.0)
    winding = run(scout, 0.0, 0.03, radio_link.encode_jump())
    winding = run(scout, 0.03, 0.9)
    assert scout.spring is Spring.REWINDING
    stopped = run(scout, 0.93, 0.3)
    assert 0.0 < stopped["winch"] < winding["winch"]
    assert run(scout, 1.3, 3.0) == stopped


def test_no_experiment_lasts_as_long_as_the_shipped_battery() -> None:
    scout = Scout()
    run(scout, 0.0, 0.1, radio_link.encode_transmitter_on("video1"))
    assert scout.battery.share(24 * 3600.0) > 0.8


def test_a_body_has_the_battery_that_the_world_gives_it() -> None:
    small, own = RobotPlace("small", 2, 5.0, 3.0, 0.0, battery_j=40.0), RobotPlace("own", 3, 7.0, 3.0, 0.0)
    room = scouts(small, own)
    assert isinstance(Scout(), PoweredRobot)
    for network_id, capacity_j in ((2, 40.0), (3, dimensions.BATTERY_J)):
        for _ in range(90):
            room.hear(network_id, radio_link.encode_transmitter_on("video1"))
            room.step_frame()
        drawn_j = 3.0 * (dimensions.IDLE_W + dimensions.TRANSMITTER_W)
        charge = radio_link.decode_reply(room.reply(network_id)).battery
        assert charge == pytest.approx(1.0 - drawn_j / capacity_j, abs=0.03)


@pytest.mark.parametrize("battery_j", [0.0, -1.0, math.inf, math.nan])
def test_a_battery_that_cannot_be_is_refused(battery_j: float) -> None:
    with pytest.raises(InvalidWorld, match=r"small with a battery of"):
        scouts(RobotPlace("small", 2, 5.0, 3.0, 0.0, battery_j=battery_j))


def test_a_battery_for_a_body_without_one_is_refused() -> None:
    with pytest.raises(InvalidWorld, match=r"rover:Rover has no battery, so none of 40 J"):
        scouts(RobotPlace("rover1", 2, 8.0, 5.0, 0.0, "rover:Rover", battery_j=40.0))


@given(st.floats(0, math.pi), st.floats(-math.pi, math.pi), st.floats(3.0, 20.0))
def test_what_is_felt_for_long_is_the_tilt(tilt_rad: float, around_rad: float, pull_m_s2: float) -> None:
    inclinometer, across_m_s2 = Inclinometer(), pull_m_s2 * math.sin(tilt_rad)
    reading = across_m_s2 * math.cos(around_rad), across_m_s2 * math.sin(around_rad), pull_m_s2 * math.cos(tilt_rad)
    assert inclinometer.tilt_rad(0.0) == 0.0
    inclinometer.feel(reading, 0.0)
    assert inclinometer.tilt_rad(100 * SMOOTHING_S) == pytest.approx(tilt_rad, abs=1e-6)


def test_a_bump_is_no_fall_and_free_fall_no_direction() -> None:
    inclinometer = Inclinometer()
    inclinometer.feel((20.0, 0.0, -5.0), 1.0)
    inclinometer.feel((0.0, 0.0, 9.81), 1.0 + FRAME_S)
    assert inclinometer.tilt_rad(1.0 + FRAME_S) < math.radians(25)
    inclinometer.feel((9.81, 0.0, 0.0), 2.0)
    assert inclinometer.tilt_rad(4.0) == pytest.approx(math.pi / 2, abs=0.01)
    inclinometer.feel((0.0, 0.0, 0.0), 4.0)
    assert inclinometer.tilt_rad(9.0) == pytest.approx(math.pi / 2, abs=0.01)
