"""Frames on a serial line: where a packet begins and ends, whom it is for, and whether it is whole.

A frame is a zero byte, the stuffed content, and a zero byte. Content: kind (1 byte), network id (1 byte), payload, and
the CRC of all three (2 bytes, high byte first). Consistent Overhead Byte Stuffing (COBS) replaces the zeros in the
content, so a zero is always the border of a frame: after a lost byte or a frame without an end, the next frame is
read again. It adds one byte to any content of up to 253 bytes, so the length of a packet alone decides its time on
the line. The CRC is CRC-16/IBM-3740 (polynomial 0x1021, begins with 0xFFFF), which libraries also
call CCITT-FALSE.

Rules of this file: pure; bytes in, bytes and frames out.

Source: Cheshire and Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Transactions on Networking, 1999.
"""

from __future__ import annotations

import binascii
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

from backbone.ranges import MOST_PAYLOAD_BYTES

BORDER = b"\0"
CRC_BEGIN, CRC_BYTES, HEAD_BYTES = 0xFFFF, 2, 2
LONGEST_RUN = 254  # of bytes that are not zero, after one code byte
MOST_BYTES = 2 * MOST_PAYLOAD_BYTES  # chosen: more than the longest frame


class SerialKind(IntEnum):
    """What a frame is for."""

    COMMAND = 1
    ASKING = 2
    """A command after which the robot replies."""
    REPLY = 3


@dataclass(frozen=True, slots=True)
class SerialFrame:
    """The content of a frame.

    Attributes:
        kind: What it is for.
        network_id: The robot that it is for, or comes from; 0 to 255.
    """

    kind: SerialKind
    network_id: int
    payload: bytes


def line_bytes(frame: SerialFrame) -> bytes:
    r"""Return the bytes of a frame on the line.

    Example:
        >>> line_bytes(SerialFrame(SerialKind.COMMAND, 7, b"H")).hex(" ")
        '00 06 01 07 48 ab f7 00'
    """
    content = bytes([frame.kind, frame.network_id]) + frame.payload
    crc = binascii.crc_hqx(content, CRC_BEGIN).to_bytes(CRC_BYTES, "big")
    return BORDER + stuffed(content + crc) + BORDER


def stuffed(content: bytes) -> bytes:
    r"""Return the content without zeros.

    Example:
        >>> stuffed(b"\x11\x22\x00\x33").hex(" ")
        '03 11 22 02 33'
    """
    stuffed = bytearray()
    for run in content.split(BORDER):
        while len(run) >= LONGEST_RUN:
            stuffed += bytes([LONGEST_RUN + 1]) + run[:LONGEST_RUN]
            run = run[LONGEST_RUN:]  # noqa: PLW2901  its rest
        stuffed += bytes([len(run) + 1]) + run
    return bytes(stuffed)


def unstuffed(stuffed: bytes) -> bytes:
    """Return the content.

    Raises:
        ValueError: A code byte points beyond the end.
    """
    content, at = bytearray(), 0
    while at < len(stuffed):
        code = stuffed[at]
        content += stuffed[at + 1 : at + code]
        at += code
        if code <= LONGEST_RUN and at < len(stuffed):
            content += BORDER
    if at > len(stuffed):
        raise ValueError("a code byte points beyond the end")
    return bytes(content)


class FrameReader:
    """Finds the frames in the bytes of a line, and leaves out what is no whole frame."""

    def __init__(self) -> None:
        self._begun = bytearray()

    def feed(self, line: bytes) -> Iterator[SerialFrame]:
        """Yield the frames that end in these bytes, which follow the ones before."""
        *ended, rest = line.split(BORDER)
        for part in ended:
            frame = _read(bytes(self._begun) + part)
            self._begun.clear()
            if frame is not None:
                yield frame
        self._begun += rest
        del self._begun[:-MOST_BYTES]  # a line without borders is noise


def _read(stuffed: bytes) -> SerialFrame | None:
    try:
        content = unstuffed(stuffed)
        inside, crc = content[:-CRC_BYTES], content[-CRC_BYTES:]
        is_of_length = HEAD_BYTES <= len(inside) <= HEAD_BYTES + MOST_PAYLOAD_BYTES
        if not is_of_length or binascii.crc_hqx(inside, CRC_BEGIN) != int.from_bytes(crc, "big"):
            return None
        return SerialFrame(SerialKind(inside[0]), inside[1], inside[HEAD_BYTES:])
    except ValueError:  # a frame without an end, or of a kind of a later version
        return None
