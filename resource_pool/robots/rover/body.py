"""The rover's on-board program: wheels, gripper, bumpers and status replies.

Rules:

* Speeds are clipped, and change at limited rates; braking is harder than acceleration.
* Reflex: if a front bumper is pressed while the rover drives forward or is about to, all forward motion stops at once.
  Forward motion stays blocked until a packet requests another motion. Turning and backing off stay possible.
* If no packet arrives for ``COMMAND_TIMEOUT_S``, the wheels stop and the transmitter switches off; the gripper keeps
  its grip, as it does at halt and safe. A stop packet also stops the gripper in its present place.
* With an empty battery the rover receives and answers nothing, its wheels are not driven and its transmitter is off;
  the gripper's screws hold without power.

Sources: data sheet of the Pioneer 2-DX for size, mass and payload; Stage's ``pioneer.inc`` for the sonars.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from typing import assert_never

from resource_pool.robots.rover.link import (
    MOST_CM,
    SONARS,
    Bumpers,
    GripPacket,
    MovePacket,
    RoverReply,
    StopPacket,
    decode,
    encode_reply,
)
from scout_model.battery import Battery, Consumption
from scout_model.dimensions import COMMAND_TIMEOUT_S
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

WHEEL_RADIUS_M = 0.0825  # chosen: wheels of 16.5 cm, as robots of this class have
TRACK_M = 0.343  # chosen: the wheels' outsides are 38 cm apart, the width of the data sheet
TOP_M_S = 1.5  # chosen: a person's brisk walk, what robots of this class reach
TOP_RAD_S = 2.6  # chosen: 150 degrees a second, on the spot without slipping
ACCELERATION_M_S2 = 1.0  # chosen: a load on the deck stays where it is
BRAKING_M_S2 = 2.0  # chosen: stops from top speed within 0.6 m, and the caster stays loaded
TURN_RAD_S2 = 4.0  # chosen: to full turn in two thirds of a second
TORQUE_LIMIT_N_M = 4.0  # chosen: drives up a slope of 10 degrees with 20 kg
PADDLES_M = 0.10  # chosen: travel of each paddle; together they open 21 cm
LIFT_M = 0.10  # chosen: travel of the lift; a lifted paddle is below the sonars
PADDLES_M_S = 0.05  # chosen: closes in two seconds
LIFT_M_S = 0.02  # Pioneer Gripper manual: approximately two centimeters per second of travel
HOLDING_N = 10.0  # chosen: a third of the paddle drive's maximum; free motion needs far less
NEAREST_CM = 10  # Stage's pioneer.inc: from 0.1 m
SPRINGS_S2 = 986.96  # stiffness over mass of the accelerometer's springs, (2 pi 5 Hz) squared, as in body.xml
BATTERY_J = 252 * 3600.0  # chosen: three batteries of 12 V and 7 Ah, as robots of this class carry
CONSUMPTION = Consumption(
    idle_w=12.0,  # chosen: with three batteries a robot of this class stands for most of a day
    transmitter_w=2.0,  # chosen: stronger than a Scout's
    motors_w=60.0,  # chosen: two motors of 30 W
)

_STAND = MovePacket(0.0, 0.0)
_FRONT_BUMPERS = ("front_bumper", "left_tip", "right_tip")
_SENSORS = (*_FRONT_BUMPERS, "rear_bumper", "left_encoder", "right_encoder", "left_torque", "right_torque")
_OTHERS = ("paddles", "lift", "paddles_force", "proof_forward", "proof_left")
_FELT_NOTHING: dict[str, Sequence[float]] = {
    **dict.fromkeys((*_SENSORS, *_OTHERS), (0.0,)),
    **{f"sonar_{number}": (-1.0,) for number in range(SONARS)},
    "gyroscope": (0.0, 0.0, 0.0),
}


class Rover:
    """A Pioneer 2-class rover; at the beginning it stands, transmitter off, gripper open and down."""

    frequency = ""
    """Frequency of its transmitter; empty while it is off."""

    def __init__(self) -> None:
        self.battery = Battery(BATTERY_J)
        """The battery."""
        self._asked = _STAND
        self._forward_m_s = self._turn_rad_s = 0.0
        self._grip = GripPacket(0.0, 0.0)
        self._paddles_m = self._lift_m = 0.0
        self._readings: Mapping[str, Sequence[float]] = _FELT_NOTHING
        self._is_blocked = False
        self._heard_s = self._now_s = 0.0
        self._is_asked = False

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body; see ``scout_model.robot.Robot``."""
        return resources.files("resource_pool.robots.rover").joinpath("body.xml").read_text(encoding="utf-8")

    @property
    def motors(self) -> float:
        """Load of its motors, 0 to 1."""
        return min(1.0, max(abs(self._forward_m_s) / TOP_M_S, abs(self._turn_rad_s) / TOP_RAD_S))

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet of ``link``; ignore it if it is malformed."""
        if self.battery.is_empty(now_s):
            return
        try:
            packet = decode(payload)
        except MalformedPacket:
            return
        self._heard_s, self._is_asked = now_s, True
        match packet:
            case MovePacket(forward_m_s, turn_rad_s):
                self._ask(MovePacket(_clip(forward_m_s, TOP_M_S), _clip(turn_rad_s, TOP_RAD_S)))
            case GripPacket():
                self._grip = packet
            case HaltPacket():
                self._ask(_STAND)
            case StopPacket():
                self._ask(_STAND)
                self._grip = GripPacket(self._paddles_m / PADDLES_M, self._lift_m / LIFT_M)
            case TransmitterOn(frequency):
                self.frequency = frequency
            case TransmitterOff():
                self.frequency = ""
            case Safe():
                self._ask(_STAND)
                self.frequency = ""
            case _:
                assert_never(packet)

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:  # noqa: ARG002 - of the protocol
        """Record the newest readings of all sensors."""
        self._readings = readings

    def controls(self, now_s: float) -> dict[str, float]:
        """Advance watchdog, reflex and ramps to this time and return the actuator controls."""
        past_s, self._now_s = now_s - self._now_s, now_s
        if self.battery.is_empty(now_s):
            self._switch_off()
        else:
            self._watch(now_s)
            self._brake_at_bumpers()
            self._advance(past_s)
            self.battery.draw(CONSUMPTION.power_w(self._load(), is_transmitting=bool(self.frequency)), now_s)
        rim_m_s = self._turn_rad_s * TRACK_M / 2
        return {
            "left_wheel": (self._forward_m_s - rim_m_s) / WHEEL_RADIUS_M,
            "right_wheel": (self._forward_m_s + rim_m_s) / WHEEL_RADIUS_M,
            "paddles": self._paddles_m,
            "lift": self._lift_m,
        }

    def reply(self, now_s: float) -> bytes:
        """Return the rover's state as a packet; empty if it obeyed no packet since its last answer."""
        if not self._is_asked or self.battery.is_empty(now_s):
            return b""
        self._is_asked = False
        return encode_reply(self._state(now_s))

    def _ask(self, asked: MovePacket) -> None:
        self._asked = asked
        if asked.forward_m_s <= 0.0:
            self._is_blocked = False

    def _switch_off(self) -> None:
        self._asked = _STAND
        self._forward_m_s = self._turn_rad_s = 0.0
        self.frequency = ""

    def _watch(self, now_s: float) -> None:
        is_active = self._asked != _STAND or self.frequency
        if is_active and now_s - self._heard_s >= COMMAND_TIMEOUT_S:
            self._asked, self.frequency = _STAND, ""

    def _brake_at_bumpers(self) -> None:
        is_pressed = any(self._readings[bumper][0] > 0.0 for bumper in _FRONT_BUMPERS)
        if is_pressed and not self._is_blocked and max(self._forward_m_s, self._asked.forward_m_s) > 0.0:
            self._is_blocked = True
        if self._is_blocked:
            self._forward_m_s = min(0.0, self._forward_m_s)

    def _advance(self, past_s: float) -> None:
        forward_m_s = 0.0 if self._is_blocked else self._asked.forward_m_s
        is_faster = abs(forward_m_s) > abs(self._forward_m_s)
        most_m_s = (ACCELERATION_M_S2 if is_faster else BRAKING_M_S2) * past_s
        self._forward_m_s = _towards(self._forward_m_s, forward_m_s, most_m_s)
        self._turn_rad_s = _towards(self._turn_rad_s, self._asked.turn_rad_s, TURN_RAD_S2 * past_s)
        self._paddles_m = _towards(self._paddles_m, self._grip.closed * PADDLES_M, PADDLES_M_S * past_s)
        self._lift_m = _towards(self._lift_m, self._grip.lift * LIFT_M, LIFT_M_S * past_s)

    def _load(self) -> float:
        torque_n_m = abs(self._readings["left_torque"][0]) + abs(self._readings["right_torque"][0])
        return min(1.0, torque_n_m / (2 * TORQUE_LIMIT_N_M))

    def _state(self, now_s: float) -> RoverReply:
        readings = self._readings
        front, left_tip, right_tip = (readings[bumper][0] > 0.0 for bumper in _FRONT_BUMPERS)
        roll_rad_s, pitch_rad_s, yaw_rad_s = readings["gyroscope"]
        return RoverReply(
            battery=self.battery.share(now_s),
            left_m=readings["left_encoder"][0] * WHEEL_RADIUS_M,
            right_m=readings["right_encoder"][0] * WHEEL_RADIUS_M,
            sonars_cm=tuple(_sonar_cm(readings[f"sonar_{number}"][0]) for number in range(SONARS)),
            bumpers=Bumpers(front, left_tip, right_tip, readings["rear_bumper"][0] > 0.0),
            is_blocked=self._is_blocked,
            gyroscope_rad_s=(roll_rad_s, pitch_rad_s, yaw_rad_s),
            acceleration_m_s2=(
                -SPRINGS_S2 * readings["proof_forward"][0],
                -SPRINGS_S2 * readings["proof_left"][0],
            ),
            closed=min(1.0, max(0.0, readings["paddles"][0] / PADDLES_M)),
            lift=min(1.0, max(0.0, readings["lift"][0] / LIFT_M)),
            is_holding=readings["paddles_force"][0] >= HOLDING_N,
        )


def _clip(number: float, most: float) -> float:
    return max(-most, min(most, number))


def _towards(now: float, wanted: float, most: float) -> float:
    """Return the value moved towards the target by at most this step."""
    return wanted if abs(wanted - now) <= most else now + (most if wanted > now else -most)


def _sonar_cm(range_m: float) -> int:
    """Return a sonar's distance in cm; a negative reading means that the ray met nothing within range."""
    return MOST_CM if range_m < 0.0 else max(NEAREST_CM, min(MOST_CM, round(100 * range_m)))
