"""The rover's on-board program alone: limits, watchdog, reflex, battery."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.rover import body, link
from resource_pool.robots.rover.body import Rover
from resource_pool.robots.rover.link import GripPacket, MovePacket, RoverReply, StopPacket
from scout_model.battery import Battery
from scout_model.dimensions import COMMAND_TIMEOUT_S
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn
from scout_model.robot import AnsweringRobot, FeelingRobot, robot_class

FRAME_S = 1 / 30
PRESSED, FREE = 12.0, 0.0
packets = st.one_of(
    st.builds(MovePacket, st.floats(-30, 30), st.floats(-30, 30)).map(link.encode),
    st.builds(GripPacket, st.floats(0, 1), st.floats(0, 1)).map(link.encode),
    st.sampled_from([StopPacket(), HaltPacket(), TransmitterOn("video1"), TransmitterOff(), Safe()]).map(link.encode),
    st.binary(max_size=8),
)


class Driven:
    """A rover, its time, and what it feels."""

    def __init__(self) -> None:
        self.rover, self.now_s = Rover(), 0.0
        self.readings: dict[str, Sequence[float]] = {
            **dict.fromkeys(("front_bumper", "left_tip", "right_tip", "rear_bumper"), (FREE,)),
            **dict.fromkeys(("left_encoder", "right_encoder", "left_torque", "right_torque"), (0.0,)),
            **dict.fromkeys(("paddles", "lift", "paddles_force", "proof_forward", "proof_left"), (0.0,)),
            **{f"sonar_{number}": (-1.0,) for number in range(link.SONARS)},
            "gyroscope": (0.0, 0.0, 0.0),
        }

    def go(self, seconds: float, *packets: link.Packet, **readings: float) -> tuple[float, float]:
        """Repeat the packets each frame while it feels this; return its speed, forward and turn."""
        self.readings |= {name: (reading,) for name, reading in readings.items()}
        for _ in range(round(seconds / FRAME_S)):
            for packet in packets:
                self.rover.hear(link.encode(packet), self.now_s)
            self.frame()
        return self.speed()

    def frame(self) -> dict[str, float]:
        self.rover.feel(self.readings, self.now_s)
        controls = self.rover.controls(self.now_s)
        self.now_s += FRAME_S
        return controls

    def speed(self) -> tuple[float, float]:
        controls = self.rover.controls(self.now_s)
        left_m_s, right_m_s = (controls[wheel] * body.WHEEL_RADIUS_M for wheel in ("left_wheel", "right_wheel"))
        return round((left_m_s + right_m_s) / 2, 9), round((right_m_s - left_m_s) / body.TRACK_M, 9)

    def told(self) -> RoverReply:
        self.rover.hear(link.encode(TransmitterOff()), self.now_s)
        return link.decode_reply(self.rover.reply(self.now_s))


def test_it_is_a_robot_that_feels_and_answers() -> None:
    rover = robot_class("resource_pool.robots.rover.body:Rover")()
    assert isinstance(rover, FeelingRobot)
    assert isinstance(rover, AnsweringRobot)


@given(st.lists(st.tuples(packets, st.integers(0, 20), st.booleans()), max_size=20))
def test_whatever_it_hears_speeds_and_their_changes_stay_within_their_limits(
    heard: list[tuple[bytes, int, bool]],
) -> None:
    driven, before = Driven(), (0.0, 0.0)
    for payload, frames, is_pressed in heard:
        driven.rover.hear(payload, driven.now_s)
        driven.readings["left_tip"] = (PRESSED if is_pressed else FREE,)
        for _ in range(frames):
            controls = driven.frame()
            left_m_s, right_m_s = (controls[wheel] * body.WHEEL_RADIUS_M for wheel in ("left_wheel", "right_wheel"))
            forward_m_s, turn_rad_s = (left_m_s + right_m_s) / 2, (right_m_s - left_m_s) / body.TRACK_M
            assert abs(forward_m_s) <= body.TOP_M_S + 1e-9
            assert abs(turn_rad_s) <= body.TOP_RAD_S + 1e-9
            assert not is_pressed or forward_m_s <= 0.0
            if not is_pressed:
                assert abs(forward_m_s - before[0]) <= body.BRAKING_M_S2 * FRAME_S + 1e-9
            assert abs(turn_rad_s - before[1]) <= body.TURN_RAD_S2 * FRAME_S + 1e-9
            assert 0.0 <= controls["paddles"] <= body.PADDLES_M
            assert 0.0 <= controls["lift"] <= body.LIFT_M
            assert 0.0 <= driven.rover.motors <= 1.0
            before = forward_m_s, turn_rad_s


def test_it_takes_its_time_to_speed_up_and_less_to_stop() -> None:
    driven = Driven()
    assert driven.go(1.0, MovePacket(1.5, 0.0))[0] == pytest.approx(body.ACCELERATION_M_S2, rel=0.05)
    assert driven.go(1.0, MovePacket(9.0, 9.0)) == (body.TOP_M_S, body.TOP_RAD_S)
    assert driven.go(0.5, HaltPacket())[0] == pytest.approx(body.TOP_M_S - body.BRAKING_M_S2 / 2, rel=0.1)
    assert driven.go(0.5, HaltPacket()) == (0.0, 0.0)


def test_silence_stops_wheels_and_transmitter_and_keeps_the_grip() -> None:
    driven = Driven()
    driven.go(3.0, MovePacket(0.3, 0.2), GripPacket(1.0, 0.4), TransmitterOn("video1"))
    held = driven.frame()
    assert (held["paddles"], held["lift"]) == (body.PADDLES_M, 0.4 * body.LIFT_M)
    driven.go(COMMAND_TIMEOUT_S - 2 * FRAME_S)
    assert driven.rover.frequency == "video1"
    driven.go(0.5)
    still = driven.frame()
    assert still == {"left_wheel": 0.0, "right_wheel": 0.0, "paddles": held["paddles"], "lift": held["lift"]}
    assert driven.rover.frequency == ""


def test_noise_does_not_keep_it_driving() -> None:
    driven = Driven()
    driven.go(1.0, MovePacket(0.5, 0.0))
    for _ in range(30):
        driven.rover.hear(b"noise", driven.now_s)
        driven.frame()
    assert driven.speed() == (0.0, 0.0)


def test_a_stop_stops_wheels_paddles_and_lift_where_they_are() -> None:
    driven = Driven()
    driven.go(1.0, MovePacket(1.0, 0.0), GripPacket(1.0, 1.0))
    assert driven.go(1.0, StopPacket()) == (0.0, 0.0)
    stopped = driven.frame()
    assert 0.0 < stopped["paddles"] < body.PADDLES_M
    assert 0.0 < stopped["lift"] < body.LIFT_M
    driven.go(5.0, StopPacket())
    assert driven.frame() == stopped


@pytest.mark.parametrize("packet", [HaltPacket(), Safe()])
def test_halt_and_safe_keep_the_grip(packet: link.Packet) -> None:
    driven = Driven()
    driven.go(6.0, GripPacket(1.0, 1.0), TransmitterOn("video1"))
    driven.go(1.0, packet)
    assert driven.frame()["paddles"] == body.PADDLES_M
    assert driven.rover.frequency == ("video1" if packet == HaltPacket() else "")


@pytest.mark.parametrize("bumper", ["front_bumper", "left_tip", "right_tip"])
def test_a_bumper_in_front_stops_it_until_something_else_than_forward_is_asked(bumper: str) -> None:
    driven = Driven()
    driven.go(2.0, MovePacket(1.0, 0.0))
    assert driven.go(FRAME_S, MovePacket(1.0, 0.0), **{bumper: PRESSED})[0] == 0.0
    assert driven.told().is_blocked
    assert driven.go(1.0, MovePacket(1.0, 1.0), **{bumper: FREE}) == (0.0, 1.0)
    assert driven.go(1.0, MovePacket(-0.3, 0.0))[0] == -0.3
    assert not driven.told().is_blocked
    assert driven.go(1.0, MovePacket(0.3, 0.0))[0] == 0.3


def test_pressed_while_it_stands_or_from_behind_it_is_free_to_back_off_and_to_go() -> None:
    driven = Driven()
    driven.go(0.5, left_tip=PRESSED)
    assert not driven.told().is_blocked
    assert driven.go(1.0, MovePacket(-0.3, 0.0))[0] == -0.3
    assert driven.go(2.0, MovePacket(0.5, 0.0), left_tip=FREE, rear_bumper=PRESSED)[0] == 0.5
    assert driven.told().bumpers == link.Bumpers(front=False, left_tip=False, right_tip=False, rear=True)


def test_it_answers_once_what_it_heard_and_not_what_was_noise() -> None:
    rover = Rover()
    assert rover.reply(0.0) == b""
    rover.hear(b"noise", 0.0)
    assert rover.reply(0.0) == b""
    rover.hear(link.encode(HaltPacket()), 0.0)
    rover.hear(link.encode(HaltPacket()), 0.0)
    assert link.decode_reply(rover.reply(0.0)).battery == 1.0
    assert rover.reply(0.0) == b""


def test_it_tells_what_it_feels_in_the_links_units() -> None:
    driven = Driven()
    driven.readings |= {"sonar_0": (0.02,), "sonar_1": (4.999,), "sonar_2": (1.234,), "gyroscope": (0.1, 0.2, -0.3)}
    driven.readings |= {
        "proof_forward": (-0.001,),
        "proof_left": (0.002,),
        "left_encoder": (10.0,),
        "paddles_force": (25.0,),
    }
    driven.go(FRAME_S, GripPacket(0.0, 0.0), paddles=0.05, lift=0.1)
    told = driven.told()
    assert told.sonars_cm == (10, 500, 123, 500, 500, 500, 500, 500)
    assert told.gyroscope_rad_s == (0.1, 0.2, -0.3)
    assert told.acceleration_m_s2 == pytest.approx((0.987, -1.974), abs=1e-3)
    assert (told.left_m, told.right_m) == (0.825, 0.0)
    assert (told.closed, told.lift, told.is_holding) == (pytest.approx(0.5, abs=0.002), 1.0, True)


def test_load_and_transmitter_empty_the_battery_sooner() -> None:
    lasts_s = []
    for torque_n_m, frequency in ((0.0, ""), (2.0, ""), (2.0, "video1")):
        driven = Driven()
        driven.rover.battery = Battery(1000.0)
        wanted = TransmitterOn(frequency) if frequency else HaltPacket()
        while not driven.rover.battery.is_empty(driven.now_s):
            driven.go(1.0, wanted, left_torque=torque_n_m, right_torque=-torque_n_m)
        lasts_s.append(driven.now_s)
    asked = body.CONSUMPTION
    powers_w = [
        asked.idle_w,
        asked.idle_w + asked.motors_w / 2,
        asked.idle_w + asked.motors_w / 2 + asked.transmitter_w,
    ]
    assert lasts_s == [pytest.approx(1000.0 / power_w, abs=1.1) for power_w in powers_w]


def test_with_an_empty_battery_it_stands_silent_and_keeps_its_grip() -> None:
    driven = Driven()
    driven.rover.battery = Battery(body.CONSUMPTION.idle_w * 4.0)
    driven.go(3.0, MovePacket(0.5, 0.5), GripPacket(1.0, 0.4), TransmitterOn("video1"))
    assert driven.told().battery < 0.3
    driven.go(2.0, MovePacket(0.5, 0.5), TransmitterOn("video1"))
    assert driven.speed() == (0.0, 0.0)
    assert driven.rover.frequency == ""
    assert driven.frame()["paddles"] == body.PADDLES_M
    driven.rover.hear(link.encode(MovePacket(0.5, 0.0)), driven.now_s)
    assert driven.rover.reply(driven.now_s) == b""
