"""Packet of a value: a header, and the value's bytes behind it or in a sealed memory file beside it. Pure.

A small value travels in the packet, which is cheaper than a memory file; a large one does not, because each reader
would copy it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from backbone.errors import Refusal
from backbone.naming import legal

HEADER = struct.Struct("<QQ")
"""Number and length of a value."""
MOST_IN_PACKET = 131_072  # measured: a memory file costs less above; a socket takes 212 992
MOST_PACKET_BYTES = HEADER.size + MOST_IN_PACKET
MOST_VALUE_BYTES = 64 * 1024 * 1024  # chosen: a 4K picture in color is 25 MB; a runaway list does not fit


class ValueTooLong(Refusal):
    """The value is longer than the blackboard admits."""

    code = "blackboard.oversized"
    remedy = "Split the value, or open writer and readers with a larger 'most_bytes'."


class NotAValue(Refusal):
    """A packet is no value."""

    code = "blackboard.malformed"
    remedy = "Write with BlackboardWriter of the same release."


class WriterStands(Refusal):
    """The board of this name has a living writer."""

    code = "blackboard.writer"
    remedy = "Choose another name, or end the other writer; the name of a killed writer is free at once."


class NoWriter(Refusal):
    """No writer of this name lives on this host, or the writer has closed its board."""

    code = "blackboard.no_writer"
    remedy = "Start the writer; then open the reader again."


class NoBlackboard(Refusal):
    """This system has no sealed memory files."""

    code = "blackboard.impossible"
    remedy = "Run on Linux; the bus itself sends by the network here."


@dataclass(frozen=True, slots=True)
class Value:
    """A whole value.

    Attributes:
        number: Grows by one with each value of its writer, and begins at 1.
        data: Its bytes, read-only. They stay as long as a view of them exists.
    """

    number: int
    data: memoryview


def files_of(name: str) -> tuple[str, str]:
    """Return the names of the socket and of the lock of a board.

    Raises:
        IllegalName: The board's name is no legal name.

    Example:
        >>> files_of("room")
        ('room.board', 'room.lock')
    """
    return f"{legal(name)}.board", f"{name}.lock"


def require_short(length: int, most_bytes: int) -> None:
    """Return if a value of this length is admitted.

    Raises:
        ValueTooLong: The value is longer than ``most_bytes``.
    """
    if length > most_bytes:
        raise ValueTooLong(f"a value of {length} bytes, but at most {most_bytes} are admitted", bytes=length)


def read_header(packet: bytes, descriptors: int, most_bytes: int) -> tuple[int, int]:
    """Return number and length of the value in a packet that came with so many descriptors.

    Raises:
        NotAValue: It is no packet of a value.
        ValueTooLong: The value is too long.
    """
    if len(packet) < HEADER.size or descriptors > 1:
        raise NotAValue(f"a packet of {len(packet)} bytes and {descriptors} descriptors")
    number, length = HEADER.unpack_from(packet)
    if len(packet) - HEADER.size != (0 if descriptors else length):
        raise NotAValue(f"{len(packet) - HEADER.size} bytes in the packet of a value of {length}")
    require_short(length, most_bytes)
    return number, length
