"""The rover's packets: encoding and decoding of commands and replies.

A packet is one byte for the command, followed by the command's values in network byte order:

* ``M`` move: two 16-bit integers, forward in mm/s and turn in mrad/s, to the left is positive
* ``G`` grip: two bytes, closing of the paddles and height of the lift; 255: closed, up
* ``Q`` stop: no values
* halt, safe, transmitter on and off: as in ``scout_model.radio_link``

The reply is ``R`` and 38 bytes. The radio adds network id and check sum, as for every robot.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn, byte_to_share, share_to_byte

SONARS = 8  # Pioneer 2-DX, front ring
MOST_CM = 500  # Stage's pioneer.inc: 5 m

_MOVE = struct.Struct("!hh")
_GRIP = struct.Struct("!BB")
_REPLY = struct.Struct("!cBii8HB3h2hBB")
_MILLI = 1000
_FRONT, _LEFT_TIP, _RIGHT_TIP, _REAR, _BLOCKED, _HOLDING = (1 << bit for bit in range(6))
_ALL_FLAGS = (1 << 6) - 1


@dataclass(frozen=True, slots=True)
class MovePacket:
    """Drive forward and turn at these speeds.

    Attributes:
        forward_m_s: Backward is negative.
        turn_rad_s: To the left is positive.
    """

    forward_m_s: float
    turn_rad_s: float


@dataclass(frozen=True, slots=True)
class GripPacket:
    """Move paddles and lift to these positions.

    Attributes:
        closed: 0, open, to 1, closed.
        lift: 0, down, to 1, up.
    """

    closed: float
    lift: float


@dataclass(frozen=True, slots=True)
class StopPacket:
    """Stop wheels, paddles and lift where they are; a halt stops the wheels only."""


@dataclass(frozen=True, slots=True)
class Bumpers:
    """Bumpers that are pressed: in front, at the tips of the paddles, at the rear."""

    front: bool
    left_tip: bool
    right_tip: bool
    rear: bool


@dataclass(frozen=True, slots=True)
class RoverReply:
    """The rover's reply.

    Attributes:
        battery: Charge of its battery, 0 to 1.
        left_m: Way of the left wheel since power-on, by the wheel's encoder; backward is negative.
        right_m: Way of the right wheel.
        sonars_cm: Distance measured by each sonar, from left to right; ``MOST_CM`` means this distance or more.
        bumpers: Bumpers that are pressed.
        is_blocked: True if a front bumper stopped the rover, and no packet has requested another motion than forward
            since.
        gyroscope_rad_s: Angular velocity about forward, left and up.
        acceleration_m_s2: Measured acceleration forward and to the left.
        closed: How far the paddles are closed, 0 to 1.
        lift: How far the lift is up, 0 to 1.
        is_holding: Whether something keeps the paddles from closing further.
    """

    battery: float
    left_m: float
    right_m: float
    sonars_cm: tuple[int, ...]
    bumpers: Bumpers
    is_blocked: bool
    gyroscope_rad_s: tuple[float, float, float]
    acceleration_m_s2: tuple[float, float]
    closed: float
    lift: float
    is_holding: bool


Packet = MovePacket | GripPacket | StopPacket | HaltPacket | TransmitterOn | TransmitterOff | Safe


def encode(packet: Packet) -> bytes:
    """Return the packet as bytes.

    Raises:
        MalformedPacket: A number is not finite or does not fit, or the frequency has no legal name.
    """
    match packet:
        case MovePacket(forward_m_s, turn_rad_s):
            return b"M" + _packed(_MOVE, _milli(forward_m_s), _milli(turn_rad_s))
        case GripPacket(closed, lift):
            return b"G" + _GRIP.pack(share_to_byte(closed), share_to_byte(lift))
        case StopPacket():
            return b"Q"
        case HaltPacket():
            return radio_link.encode_halt()
        case TransmitterOn(frequency):
            return radio_link.encode_transmitter_on(frequency)
        case TransmitterOff():
            return radio_link.encode_transmitter_off()
        case Safe():
            return radio_link.encode_safe()


def decode(payload: bytes) -> Packet:
    """Decode a packet to the rover.

    Raises:
        MalformedPacket: The bytes are not a packet to a rover.

    Example:
        >>> decode(encode(MovePacket(0.5, -1.0)))
        MovePacket(forward_m_s=0.5, turn_rad_s=-1.0)
    """
    command, values = payload[:1], payload[1:]
    if command == b"M":
        forward, turn = _unpacked(_MOVE, values)
        return MovePacket(forward / _MILLI, turn / _MILLI)
    if command == b"G":
        closed, lift = _unpacked(_GRIP, values)
        return GripPacket(byte_to_share(closed), byte_to_share(lift))
    if payload == b"Q":
        return StopPacket()
    packet = radio_link.decode(payload)
    if isinstance(packet, radio_link.DrivePacket | radio_link.JumpPacket):
        raise MalformedPacket(f"a rover has no command {command!r}")
    return packet


def encode_reply(reply: RoverReply) -> bytes:
    """Return the reply as bytes; numbers are rounded to their field's resolution and clipped to its range.

    Raises:
        MalformedPacket: A share is outside 0 to 1, a sonar's distance is out of range, or their number is not
            ``SONARS``.
    """
    if len(reply.sonars_cm) != SONARS or not all(0 <= range_cm <= MOST_CM for range_cm in reply.sonars_cm):
        raise MalformedPacket(f"{reply.sonars_cm} are no {SONARS} distances of 0 to {MOST_CM} cm")
    bumpers = reply.bumpers
    flags = (bumpers.front, bumpers.left_tip, bumpers.right_tip, bumpers.rear, reply.is_blocked, reply.is_holding)
    return _packed(
        _REPLY,
        b"R",
        share_to_byte(reply.battery),
        _wrapped(_milli(reply.left_m)),
        _wrapped(_milli(reply.right_m)),
        *reply.sonars_cm,
        sum(1 << bit for bit, is_set in enumerate(flags) if is_set),
        *(_clipped(_milli(turn_rad_s)) for turn_rad_s in reply.gyroscope_rad_s),
        *(_clipped(_milli(along_m_s2)) for along_m_s2 in reply.acceleration_m_s2),
        share_to_byte(reply.closed),
        share_to_byte(reply.lift),
    )


def decode_reply(payload: bytes) -> RoverReply:
    """Decode a reply of the rover.

    Raises:
        MalformedPacket: The bytes are not a reply of a rover.
    """
    if payload[:1] != b"R" or len(payload) != _REPLY.size:
        raise MalformedPacket(f"{len(payload)} bytes that begin with {payload[:1]!r} are no answer of a rover")
    _, battery, left, right, *rest = _REPLY.unpack(payload)
    sonars_cm, flags, inertial, (closed, lift) = tuple(rest[:SONARS]), rest[SONARS], rest[9:14], rest[14:]
    if max(sonars_cm) > MOST_CM or flags & ~_ALL_FLAGS:
        raise MalformedPacket(f"sonars {sonars_cm} and flags {flags:#x} are no answer of a rover")
    roll, pitch, yaw, ahead, aside = (number / _MILLI for number in inertial)
    return RoverReply(
        battery=byte_to_share(battery),
        left_m=left / _MILLI,
        right_m=right / _MILLI,
        sonars_cm=sonars_cm,
        bumpers=Bumpers(*(bool(flags & bit) for bit in (_FRONT, _LEFT_TIP, _RIGHT_TIP, _REAR))),
        is_blocked=bool(flags & _BLOCKED),
        gyroscope_rad_s=(roll, pitch, yaw),
        acceleration_m_s2=(ahead, aside),
        closed=byte_to_share(closed),
        lift=byte_to_share(lift),
        is_holding=bool(flags & _HOLDING),
    )


def _milli(number: float) -> int:
    if not math.isfinite(number * _MILLI):
        raise MalformedPacket(f"{number} is not finite, or too large")
    return round(number * _MILLI)


def _clipped(number: int) -> int:
    return max(-(1 << 15), min((1 << 15) - 1, number))


def _wrapped(number: int) -> int:
    """Return the number as a 32-bit counter shows it; the counter wraps around after 2000 km."""
    return (number + (1 << 31)) % (1 << 32) - (1 << 31)


def _packed(shape: struct.Struct, *values: int | bytes) -> bytes:
    try:
        return shape.pack(*values)
    except struct.error as error:
        raise MalformedPacket(f"{values} do not fit: {error}") from error


def _unpacked(shape: struct.Struct, values: bytes) -> tuple[int, ...]:
    if len(values) != shape.size:
        raise MalformedPacket(f"{shape.size} bytes of values belong here, not {len(values)}")
    return shape.unpack(values)
