"""The walker's packets on the digital link: joint targets to the walker, status from it.

A packet is one byte for the command, followed by the command's values in network byte order:

* ``Q`` joint targets: time in which the joints shall arrive, one byte in units of 4 ms; twelve 16-bit joint angles in
  units of 1e-4 rad, in the order of ``JOINTS``
* ``H`` halt (stand still), ``S`` safe, ``V`` and ``X`` transmitter on and off: as ``scout_model.radio_link``
* ``T`` status, the walker's reply: battery, one byte in units of 1/255; roll, pitch and twelve joint angles as above;
  turning speed, 16 bits in units of 1e-3 rad/s; one byte with a bit for each foot on the floor, in the order of
  ``LEGS``, the first is the lowest

The radio adds network id and check sum outside of the payload.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from resource_pool.robots.walker.gait import LEGS
from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

JOINTS = tuple(f"{leg}_{joint}" for leg in LEGS for joint in ("abduction", "hip", "knee"))
"""Joints, and their actuators and sensors in the body, in the packets' order."""

Angles = tuple[float, ...]
"""One angle for each of ``JOINTS``, rad."""

ANGLE_RAD = 1e-4  # chosen: a hundredth of what a servo resolves; 16 bits then reach 187 degrees
TURN_RAD_S = 1e-3  # chosen: 16 bits then reach five turns a second
TICK_S = 0.004  # chosen: one byte then reaches a second, twice the watchdog's time
LONGEST_S = 255 * TICK_S

_TARGETS = struct.Struct("!B12h")
_STATUS = struct.Struct("!B15hB")


@dataclass(frozen=True, slots=True)
class JointTargets:
    """Move each joint evenly to its target and arrive after this time."""

    targets_rad: Angles
    within_s: float


@dataclass(frozen=True, slots=True)
class Status:
    """The walker's status.

    Attributes:
        battery: Share of its charge that is left, 0 to 1.
        roll_rad: Tilt to the right.
        pitch_rad: Tilt forward, nose down.
        turn_rad_s: Measured turning speed, left is positive; the link clips it at five turns a second.
        joints_rad: Measured angles.
        on_floor: Whether each foot of ``LEGS`` carries weight.
    """

    battery: float
    roll_rad: float
    pitch_rad: float
    turn_rad_s: float
    joints_rad: Angles
    on_floor: tuple[bool, ...]


Packet = JointTargets | HaltPacket | TransmitterOn | TransmitterOff | Safe


def encode_joint_targets(targets: JointTargets) -> bytes:
    """Return the packet that moves the joints; its numbers are rounded to the link's units.

    Raises:
        MalformedPacket: There are not twelve targets, one is not finite or too large, or the time is too long.
    """
    if not 0.0 <= targets.within_s <= LONGEST_S:
        raise MalformedPacket(f"joint targets within {targets.within_s} s, not 0 to {LONGEST_S:.2f} s")
    return b"Q" + _TARGETS.pack(round(targets.within_s / TICK_S), *_units(targets.targets_rad))


def encode_status(status: Status) -> bytes:
    """Return the walker's reply; its numbers are rounded to the link's units.

    Raises:
        MalformedPacket: There are not twelve angles and four feet, or a number is outside its range.
    """
    if not 0.0 <= status.battery <= 1.0:
        raise MalformedPacket(f"a battery of {status.battery}, not 0 to 1")
    if len(status.on_floor) != len(LEGS):
        raise MalformedPacket(f"{len(status.on_floor)} feet, not {len(LEGS)}")
    tilt = [_unit(status.roll_rad), _unit(status.pitch_rad)]
    feet = sum(1 << leg for leg, on_floor in enumerate(status.on_floor) if on_floor)
    if not math.isfinite(status.turn_rad_s / TURN_RAD_S):
        raise MalformedPacket(f"a turning speed of {status.turn_rad_s} rad/s")
    turn = max(-0x8000, min(0x7FFF, round(status.turn_rad_s / TURN_RAD_S)))
    return b"T" + _STATUS.pack(round(status.battery * 255), *tilt, *_units(status.joints_rad), turn, feet)


def decode(payload: bytes) -> Packet:
    """Decode a packet to the walker.

    Raises:
        MalformedPacket: The bytes are not a packet to a walker.
    """
    if payload[:1] == b"Q":
        ticks, *units = _unpack(_TARGETS, payload)
        return JointTargets(_angles(units), ticks * TICK_S)
    packet = radio_link.decode(payload)
    if isinstance(packet, HaltPacket | TransmitterOn | TransmitterOff | Safe):
        return packet
    raise MalformedPacket(f"a walker has no use for {type(packet).__name__}")


def decode_status(payload: bytes) -> Status:
    """Decode a reply of the walker.

    Raises:
        MalformedPacket: The bytes are not a status.
    """
    if payload[:1] != b"T":
        raise MalformedPacket(f"no status begins with {payload[:1]!r}")
    battery, roll, pitch, *units, turn, feet = _unpack(_STATUS, payload)
    if feet >> len(LEGS):
        raise MalformedPacket(f"feet {feet:#x} of a robot with {len(LEGS)}")
    on_floor = tuple(bool(feet >> leg & 1) for leg in range(len(LEGS)))
    tilt_rad = roll * ANGLE_RAD, pitch * ANGLE_RAD
    return Status(battery / 255, *tilt_rad, turn * TURN_RAD_S, _angles(units), on_floor)


def _unpack(layout: struct.Struct, payload: bytes) -> tuple[int, ...]:
    values = payload[1:]
    if len(values) != layout.size:
        raise MalformedPacket(f"{payload[:1]!r} takes {layout.size} bytes of values, not {len(values)}")
    return layout.unpack(values)


def _angles(units: list[int]) -> Angles:
    return tuple(unit * ANGLE_RAD for unit in units)


def _units(angles_rad: Angles) -> list[int]:
    if len(angles_rad) != len(JOINTS):
        raise MalformedPacket(f"{len(angles_rad)} joint angles, not {len(JOINTS)}")
    return [_unit(angle_rad) for angle_rad in angles_rad]


def _unit(angle_rad: float) -> int:
    units = round(angle_rad / ANGLE_RAD) if math.isfinite(angle_rad / ANGLE_RAD) else 1 << 15
    if not -(1 << 15) <= units < 1 << 15:
        raise MalformedPacket(f"an angle of {angle_rad} rad does not fit 16 bits of {ANGLE_RAD} rad")
    return units
