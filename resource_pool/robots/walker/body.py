"""The walker's on-board program: a servo board that receives joint targets and reports sensor readings.

Rules:

* A malformed packet changes nothing and does not reset the watchdog.
* Between packets the board moves each joint evenly to its target, never faster than its servo.
* The world asks for controls thirty times a second. That is enough: with targets interpolated for each of the 240
  physics steps, the trot was no faster and tilted no less. 15 to 30 packets a second are enough; at ten, the trot keeps
  two thirds of its speed.
* Halt, safe and half a second without a packet bring the legs to the standing posture; the last two also switch the
  transmitter off. While the walker stands, all controls are zero, so that the world can put it to sleep.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import assert_never

from resource_pool.robots.walker import link
from resource_pool.robots.walker.gait import LEGS
from resource_pool.robots.walker.link import JOINTS, Angles, JointTargets, Status
from scout_model.dimensions import COMMAND_TIMEOUT_S, FRAMES_PER_S
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

SERVO_SPEED_LIMIT_RAD_S = 8.0  # chosen: a fast hobby servo; with 5 the trot is a tenth slower, without limit no faster
STAND_S = 0.3  # chosen: sets lifted feet down without a blow
CHARGE_J = 75_000.0  # chosen: 7.2 V and 2.9 Ah, the size of an AIBO's battery
IDLE_W = 4.0  # chosen: computer, camera, radio
SERVOS_W = 20.0  # chosen: with all servos at full speed; empty after two hours of trot, five of standing
TICK_S = 1 / FRAMES_PER_S  # the world's frame
MOST_WAY_RAD = SERVO_SPEED_LIMIT_RAD_S * TICK_S
STANDING: Angles = (0.0,) * len(JOINTS)


class Walker:
    """A four-legged robot's program; at the beginning the robot stands, transmitter off, battery full."""

    frequency = ""
    """Frequency of its transmitter; empty while it is off."""
    motors = 0.0
    """Average speed of its servos, 0 to 1 of their limit."""

    def __init__(self) -> None:
        self._targets_rad = self._driven_rad = STANDING
        self._arrive_s = 0.0
        self._heard_s = 0.0
        self._ticked_s = -1.0
        self._charge_j = CHARGE_J
        self._has_felt = False
        self._tilt_rad = (0.0, 0.0)
        self._turn_rad_s = 0.0
        self._joints_rad = STANDING
        self._on_floor = (False,) * len(LEGS)

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body; see ``scout_model.robot.Robot``."""
        return resources.files("resource_pool.robots.walker").joinpath("body.xml").read_text(encoding="utf-8")

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet; ignore it if it is malformed."""
        try:
            packet = link.decode(payload)
        except MalformedPacket:
            return
        self._heard_s = now_s
        match packet:
            case JointTargets(targets_rad, within_s):
                self._aim(targets_rad, now_s + within_s)
            case HaltPacket():
                self._stand(now_s)
            case TransmitterOn(frequency):
                self.frequency = frequency
            case TransmitterOff():
                self.frequency = ""
            case Safe():
                self._stand(now_s)
                self.frequency = ""
            case _:
                assert_never(packet)

    def controls(self, now_s: float) -> dict[str, float]:
        """Advance to this time and return the servos' targets by actuator."""
        is_active = self._targets_rad != STANDING or self.frequency
        if is_active and now_s - self._heard_s >= COMMAND_TIMEOUT_S:
            self._stand(now_s)
            self.frequency = ""
        if now_s > self._ticked_s:
            self._move(self._arrive_s - now_s)
            self._ticked_s = now_s
        return dict(zip(JOINTS, self._driven_rad, strict=True))

    def feel(self, readings: Mapping[str, Sequence[float]], now_s: float) -> None:  # noqa: ARG002  # as reply
        """Record the newest reading of each sensor of the body, by the sensor's name."""
        self._has_felt = True
        self._tilt_rad = _tilt_rad(*readings["attitude"])
        self._turn_rad_s = float(readings["gyro"][2])
        self._joints_rad = tuple(float(readings[joint][0]) for joint in JOINTS)
        self._on_floor = tuple(readings[f"{leg}_foot"][0] > 0.0 for leg in LEGS)

    def reply(self, now_s: float) -> bytes:  # noqa: ARG002  # the robots' common signature
        """Return the walker's status as a packet; empty before the first sensor readings."""
        if not self._has_felt:
            return b""
        battery = self._charge_j / CHARGE_J
        return link.encode_status(Status(battery, *self._tilt_rad, self._turn_rad_s, self._joints_rad, self._on_floor))

    def _aim(self, targets_rad: Angles, arrive_s: float) -> None:
        self._targets_rad, self._arrive_s = targets_rad, arrive_s

    def _stand(self, now_s: float) -> None:
        self._aim(STANDING, now_s + STAND_S)

    def _move(self, left_s: float) -> None:
        """Set the joints' targets for the next tick, so that the joints arrive evenly within the time left."""
        share = TICK_S / left_s if left_s > TICK_S else 1.0
        before_rad = self._driven_rad
        self._driven_rad = tuple(
            _approach(driven, driven + share * (target - driven) if share < 1.0 else target)
            for target, driven in zip(self._targets_rad, before_rad, strict=True)
        )
        way_rad = sum(abs(after - before) for after, before in zip(self._driven_rad, before_rad, strict=True))
        self.motors = way_rad / (MOST_WAY_RAD * len(JOINTS))
        self._charge_j = max(0.0, self._charge_j - (IDLE_W + SERVOS_W * self.motors) * TICK_S)


def _tilt_rad(w: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Return roll to the right and pitch forward of this attitude."""
    roll_rad = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll_rad, math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))


def _approach(driven_rad: float, wanted_rad: float) -> float:
    """Return the wanted angle, or the nearest angle that the servo can reach in one tick."""
    return max(driven_rad - MOST_WAY_RAD, min(driven_rad + MOST_WAY_RAD, wanted_rad))
