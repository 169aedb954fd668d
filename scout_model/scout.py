"""The Scout's firmware: the robot's reactions to packets.

Packets and time go in, actuator positions come out; the world computes the physics.

Rules:

* A malformed packet changes nothing and does not reset the watchdog.
* If no packet arrives for ``COMMAND_TIMEOUT_S``, the wheels stop and the transmitter switches off.
* A jump has three phases: preload, kick, rewind. Until the spring is wound, another jump is refused. Halt, safe and the
watchdog stop a jump before its kick; a released spring cannot be stopped.

Source: IROS 2001, section 2: the on-board processors do communications and actuator control only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from importlib import resources
from typing import NamedTuple, assert_never

from scout_model.battery import Battery, Consumption
from scout_model.dimensions import (
    BATTERY_J,
    COMMAND_TIMEOUT_S,
    FOOT_PRELOAD_M,
    FOOT_STROKE_M,
    IDLE_W,
    KICK_S,
    MOTORS_W,
    PRELOAD_S,
    TRACK_M,
    TRANSMITTER_W,
    WHEEL_RADIUS_M,
    WHEEL_SPEED_LIMIT_RAD_S,
    WHEEL_TORQUE_LIMIT_N_M,
    WINCH_SPEED_M_S,
)
from scout_model.errors import MalformedPacket
from scout_model.inclinometer import Inclinometer
from scout_model.radio_link import (
    DrivePacket,
    HaltPacket,
    JumpPacket,
    Safe,
    ScoutReply,
    TransmitterOff,
    TransmitterOn,
    decode,
    encode_reply,
)

_CONSUMPTION = Consumption(IDLE_W, TRANSMITTER_W, MOTORS_W)


class Spring(StrEnum):
    """Phase of the spring foot's jump."""

    WOUND = "wound"
    PRELOADING = "preloading"
    KICKING = "kicking"
    REWINDING = "rewinding"


class Actuation(NamedTuple):
    """Commands to the actuators until the next tick.

    Attributes:
        left_rad_s: Left wheel, forward is positive, within ``WHEEL_SPEED_LIMIT_RAD_S``.
        right_rad_s: Right wheel.
        kick: True while the spring's latch is open.
        winch_m: Length of line that the winch has paid out for the foot, 0 to ``FOOT_STROKE_M``.
    """

    left_rad_s: float
    right_rad_s: float
    kick: bool
    winch_m: float


def clip_wheel_speed(speed_rad_s: float) -> float:
    """Return the wheel speed clipped to the motor's limit.

    Example:
        >>> clip_wheel_speed(-100.0)
        -17.5
    """
    return max(-WHEEL_SPEED_LIMIT_RAD_S, min(WHEEL_SPEED_LIMIT_RAD_S, speed_rad_s))


def wheels_rad_s(forward_m_s: float, turn_rad_s: float) -> tuple[float, float]:
    """Return the speeds of the left and the right wheel for this motion; left turns are positive.

    Example:
        >>> wheels_rad_s(0.2, 0.0)
        (10.0, 10.0)
    """
    side_m_s = turn_rad_s * TRACK_M / 2
    return (forward_m_s - side_m_s) / WHEEL_RADIUS_M, (forward_m_s + side_m_s) / WHEEL_RADIUS_M


def motion_of_wheels(left_rad_s: float, right_rad_s: float) -> tuple[float, float]:
    """Return the motion of these wheel speeds: forward in meters, turning in radians a second.

    Example:
        >>> motion_of_wheels(10.0, 10.0)
        (0.2, 0.0)
    """
    forward_m_s = (left_rad_s + right_rad_s) * WHEEL_RADIUS_M / 2
    return forward_m_s, (right_rad_s - left_rad_s) * WHEEL_RADIUS_M / TRACK_M


class Firmware:
    """One Scout's on-board program; wheels at rest, transmitter off and spring wound at the beginning."""

    frequency = ""
    """Frequency of the transmitter; empty while it is off."""

    def __init__(self) -> None:
        self._left_rad_s = self._right_rad_s = 0.0
        self._heard_s = 0.0
        self._is_asked = False
        self.spring = Spring.WOUND
        """Phase of the spring foot's jump."""
        self._spring_since_s = 0.0
        self._let_out_m = 0.0

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet; ignore it if it is malformed.

        Args:
            payload: As ``scout_model.radio_link`` encodes it.
            now_s: Time, never before an earlier call's.
        """
        try:
            packet = decode(payload)
        except MalformedPacket:
            return
        self._heard_s, self._is_asked = now_s, True
        match packet:
            case DrivePacket(left_rad_s, right_rad_s):
                self._left_rad_s, self._right_rad_s = clip_wheel_speed(left_rad_s), clip_wheel_speed(right_rad_s)
            case HaltPacket():
                self._halt(now_s)
            case JumpPacket():
                self._jump(now_s)
            case TransmitterOn(frequency):
                self.frequency = frequency
            case TransmitterOff():
                self.frequency = ""
            case Safe():
                self._safe(now_s)
            case _:
                assert_never(packet)

    def tick(self, now_s: float) -> Actuation:
        """Advance watchdog and jump to this time and return the actuator controls."""
        is_active = self._left_rad_s or self._right_rad_s or self.frequency or self.spring is Spring.PRELOADING
        if is_active and now_s - self._heard_s >= COMMAND_TIMEOUT_S:
            self._safe(now_s)
        winch_m = self._advance_spring(now_s)
        return Actuation(self._left_rad_s, self._right_rad_s, self.spring is Spring.KICKING, winch_m)

    def _halt(self, now_s: float) -> None:
        self._left_rad_s = self._right_rad_s = 0.0
        if self.spring is Spring.PRELOADING:
            self._rewind(FOOT_PRELOAD_M, now_s)

    def _safe(self, now_s: float) -> None:
        self._halt(now_s)
        self.frequency = ""

    def _jump(self, now_s: float) -> None:
        if self.spring is not Spring.WOUND:
            return
        # A body that rolls while its foot is on the floor trips over the foot.
        self._left_rad_s = self._right_rad_s = 0.0
        self._enter(Spring.PRELOADING, now_s)

    def _rewind(self, let_out_m: float, now_s: float) -> None:
        self._let_out_m = let_out_m
        self._enter(Spring.REWINDING, now_s)

    def _enter(self, spring: Spring, now_s: float) -> None:
        self.spring, self._spring_since_s = spring, now_s

    def _advance_spring(self, now_s: float) -> float:
        """Advance the jump to this time and return the length paid out by the winch."""
        elapsed_s = now_s - self._spring_since_s
        match self.spring:
            case Spring.WOUND:
                return 0.0
            case Spring.PRELOADING:
                if elapsed_s < PRELOAD_S:
                    return FOOT_PRELOAD_M
                self._enter(Spring.KICKING, now_s)
                return FOOT_STROKE_M
            case Spring.KICKING:
                if elapsed_s >= KICK_S:
                    self._rewind(FOOT_STROKE_M, now_s)
                return FOOT_STROKE_M
            case Spring.REWINDING:
                winch_m = self._let_out_m - WINCH_SPEED_M_S * elapsed_s
                if winch_m > 0:
                    return winch_m
                self._enter(Spring.WOUND, now_s)
                return 0.0
            case _:
                assert_never(self.spring)


class Scout(Firmware):
    """The Scout as a kind of robot: the body of ``scout.xml``, its battery, and the firmware's actuation by actuator.

    If the battery is empty, the Scout receives nothing, its wheels are not driven and its transmitter is off; winch and
    latch of the spring stay as they are.
    """

    def __init__(self) -> None:
        super().__init__()
        self.battery = Battery(BATTERY_J)
        """The battery."""
        self._inclinometer = Inclinometer()
        self._load = 0.0
        self._draws: tuple[float, bool] | None = None
        self._actuation = Actuation(0.0, 0.0, kick=False, winch_m=0.0)

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body; see ``scout_model.robot.Robot``."""
        return resources.files("scout_model").joinpath("scout.xml").read_text(encoding="utf-8")

    @property
    def motors(self) -> float:
        """Load of its motors, 0 to 1."""
        return max(abs(self._left_rad_s), abs(self._right_rad_s)) / WHEEL_SPEED_LIMIT_RAD_S

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet unless the battery is empty; see ``Firmware.hear``."""
        if not self.battery.is_empty(now_s):
            super().hear(payload, now_s)

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:
        """Record the readings of accelerometer and motor currents."""
        self._inclinometer.feel(readings["accelerometer"], now_s)
        torque_n_m = abs(readings["left_torque"][0]) + abs(readings["right_torque"][0])
        self._load = min(1.0, torque_n_m / (2 * WHEEL_TORQUE_LIMIT_N_M))

    def reply(self, now_s: float) -> bytes:
        """Return charge, tilt and load as a packet; empty if the Scout obeyed no packet since its last reply."""
        if not self._is_asked or self.battery.is_empty(now_s):
            return b""
        self._is_asked = False
        return encode_reply(ScoutReply(self.battery.share(now_s), self._inclinometer.tilt_rad(now_s), self._load))

    def controls(self, now_s: float) -> dict[str, float]:
        """Advance to this time and return the actuator controls."""
        if self.battery.is_empty(now_s):
            self._safe(now_s)
            self._actuation = self._actuation._replace(left_rad_s=0.0, right_rad_s=0.0)
        else:
            self._actuation = self.tick(now_s)
            if (draws := (self._load, bool(self.frequency))) != self._draws:
                self._draws = draws
                self.battery.draw(_CONSUMPTION.power_w(self._load, is_transmitting=bool(self.frequency)), now_s)
        return {
            "left_wheel": self._actuation.left_rad_s,
            "right_wheel": self._actuation.right_rad_s,
            "kick": float(self._actuation.kick),
            "winch": self._actuation.winch_m,
        }
