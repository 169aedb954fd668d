"""The command radio's packets: encoding and decoding of a Scout's commands and replies.

A packet is one byte for the command, followed by the command's values in network byte order:

* ``D`` drive: two 32-bit floats, left and right wheel in rad/s, forward is positive
* ``H`` halt, ``J`` jump, ``S`` safe, ``X`` transmitter off: no values
* ``V`` transmitter on: name of the video frequency, 1 to 15 ASCII characters

The Scout's reply is ``R``, then one byte each for battery charge, tilt (255: upside down) and load of the motors.

The radio adds the network id of the addressed Scout outside of the payload.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from scout_model.errors import MalformedPacket

MAX_FREQUENCY_NAME_BYTES = 15  # chosen: a transmitter-on packet then has 16 bytes
HEAD_BYTES = 3  # chosen: network id and a check sum of two bytes
BITS_PER_BYTE = 10  # chosen: serial, with a start and a stop bit
FIRST_NETWORK_ID = 1
LAST_NETWORK_ID = 254  # chosen: one byte, without 0 and 255

_DRIVE = struct.Struct("!ff")
_REPLY = struct.Struct("!cBBB")


@dataclass(frozen=True, slots=True)
class DrivePacket:
    """Turn the wheels at these speeds, forward is positive."""

    left_rad_s: float
    right_rad_s: float


@dataclass(frozen=True, slots=True)
class HaltPacket:
    """Stop the wheels."""


@dataclass(frozen=True, slots=True)
class JumpPacket:
    """Lower the foot, kick, rewind the spring."""


@dataclass(frozen=True, slots=True)
class TransmitterOn:
    """Send the camera's picture on this frequency."""

    frequency: str


@dataclass(frozen=True, slots=True)
class TransmitterOff:
    """Send no picture."""


@dataclass(frozen=True, slots=True)
class Safe:
    """Stop the wheels and send no picture."""


@dataclass(frozen=True, slots=True)
class ScoutReply:
    """A Scout's reply.

    Attributes:
        battery: Charge of its battery, 0 to 1.
        tilt_rad: Angle between its up axis and the vertical, 0 to pi.
        load: Load of its motors, 0 to 1.
    """

    battery: float
    tilt_rad: float
    load: float


Packet = DrivePacket | HaltPacket | JumpPacket | TransmitterOn | TransmitterOff | Safe


def packet_bits(payload: bytes) -> int:
    """Return the size in bits of a packet with this payload on the air, header included.

    Example:
        >>> packet_bits(encode_halt())
        40
    """
    return (HEAD_BYTES + len(payload)) * BITS_PER_BYTE


def encode_drive(left_rad_s: float, right_rad_s: float) -> bytes:
    """Return the packet that turns the wheels.

    Raises:
        MalformedPacket: A speed is not finite or too large for 32 bits.
    """
    if not (math.isfinite(left_rad_s) and math.isfinite(right_rad_s)):
        raise MalformedPacket(f"wheel speeds {left_rad_s}, {right_rad_s} are not finite")
    try:
        return b"D" + _DRIVE.pack(left_rad_s, right_rad_s)
    except OverflowError as error:
        raise MalformedPacket(f"wheel speeds {left_rad_s}, {right_rad_s} do not fit 32 bits") from error


def encode_halt() -> bytes:
    """Return the packet that stops the wheels."""
    return b"H"


def encode_jump() -> bytes:
    """Return the packet that makes the Scout jump."""
    return b"J"


def encode_transmitter_on(frequency: str) -> bytes:
    """Return the packet that switches the video transmitter on.

    Raises:
        MalformedPacket: The name is empty, too long, or not printable ASCII without spaces.
    """
    _check_frequency(frequency)
    return b"V" + frequency.encode("ascii")


def encode_transmitter_off() -> bytes:
    """Return the packet that switches the video transmitter off."""
    return b"X"


def encode_safe() -> bytes:
    """Return the packet that stops the wheels and switches the transmitter off."""
    return b"S"


def decode(payload: bytes) -> Packet:
    """Decode a packet to a Scout.

    Raises:
        MalformedPacket: The bytes are not a packet.

    Example:
        >>> decode(encode_drive(1.0, -1.0))
        DrivePacket(left_rad_s=1.0, right_rad_s=-1.0)
    """
    command, values = payload[:1], payload[1:]
    if command == b"D":
        return _decode_drive(values)
    if command == b"V":
        return _decode_transmitter_on(values)
    if values:
        raise MalformedPacket(f"{len(values)} bytes follow a command {command!r}, which takes none")
    match command:
        case b"H":
            return HaltPacket()
        case b"J":
            return JumpPacket()
        case b"S":
            return Safe()
        case b"X":
            return TransmitterOff()
    raise MalformedPacket(f"no command begins with {command!r}")


def encode_reply(reply: ScoutReply) -> bytes:
    """Return the reply as bytes; each number is rounded to a 255th of its range.

    Raises:
        MalformedPacket: A number is outside its range.
    """
    return _REPLY.pack(
        b"R", share_to_byte(reply.battery), share_to_byte(reply.tilt_rad / math.pi), share_to_byte(reply.load)
    )


def decode_reply(payload: bytes) -> ScoutReply:
    """Decode a Scout's reply.

    Raises:
        MalformedPacket: The bytes are not a reply of a Scout.
    """
    if len(payload) != _REPLY.size or payload[:1] != b"R":
        raise MalformedPacket(f"{payload!r} is no answer of a Scout")
    _, battery, tilt, load = _REPLY.unpack(payload)
    return ScoutReply(byte_to_share(battery), byte_to_share(tilt) * math.pi, byte_to_share(load))


def share_to_byte(share: float) -> int:
    """Return a share, 0 to 1, as a byte, 0 to 255.

    Raises:
        MalformedPacket: The number is outside 0 to 1.
    """
    if not 0.0 <= share <= 1.0:
        raise MalformedPacket(f"{share} is not between 0 and 1")
    return round(share * 255)


def byte_to_share(byte: int) -> float:
    """Return the share, 0 to 1, that a byte encodes."""
    return byte / 255


def _decode_drive(values: bytes) -> DrivePacket:
    if len(values) != _DRIVE.size:
        raise MalformedPacket(f"drive takes {_DRIVE.size} bytes of speeds, not {len(values)}")
    left_rad_s, right_rad_s = _DRIVE.unpack(values)
    if not (math.isfinite(left_rad_s) and math.isfinite(right_rad_s)):
        raise MalformedPacket(f"wheel speeds {left_rad_s}, {right_rad_s} are not finite")
    return DrivePacket(left_rad_s, right_rad_s)


def _decode_transmitter_on(values: bytes) -> TransmitterOn:
    try:
        frequency = values.decode("ascii")
    except UnicodeDecodeError as error:
        raise MalformedPacket(f"the name of a frequency is not ASCII: {values!r}") from error
    _check_frequency(frequency)
    return TransmitterOn(frequency)


def _check_frequency(frequency: str) -> None:
    legal = frequency.isascii() and frequency.isprintable() and " " not in frequency
    if not legal or not 1 <= len(frequency) <= MAX_FREQUENCY_NAME_BYTES:
        raise MalformedPacket(
            f"{frequency!r} names no frequency: 1 to {MAX_FREQUENCY_NAME_BYTES} printable ASCII characters, no space"
        )
