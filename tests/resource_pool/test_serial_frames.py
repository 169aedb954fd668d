"""Frames on a serial line: the reader yields only whole frames, also after lost or added bytes."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.ranges import MOST_PAYLOAD_BYTES
from resource_pool.drivers.serial_frames import FrameReader, SerialFrame, SerialKind, line_bytes, stuffed, unstuffed

PAYLOADS = st.binary(max_size=600) | st.binary(max_size=3).map(lambda some: some + bytes(300) + bytes([7]) * 600)
FRAMES = st.builds(SerialFrame, st.sampled_from(SerialKind), st.integers(0, 255), PAYLOADS)


def crc_16(content: bytes) -> int:
    """CRC-16/IBM-3740 by its definition, bit by bit."""
    crc = 0xFFFF
    for byte in content:
        crc ^= byte << 8
        for _bit in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def read(line: bytes) -> list[SerialFrame]:
    return [*FrameReader().feed(line)]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("00", "01 01"),
        ("00 00", "01 01 01"),
        ("00 11 00", "01 02 11 01"),
        ("11 22 00 33", "03 11 22 02 33"),
        ("11 22 33 44", "05 11 22 33 44"),
        ("11 00 00 00", "02 11 01 01 01"),
    ],
)
def test_content_is_stuffed_as_published(content: str, line: str) -> None:
    """The examples of the article "Consistent Overhead Byte Stuffing" of Wikipedia."""
    assert stuffed(bytes.fromhex(content)) == bytes.fromhex(line)
    assert unstuffed(bytes.fromhex(line)) == bytes.fromhex(content)


def test_a_run_of_254_bytes_needs_one_code_whether_or_not_an_empty_run_follows() -> None:
    run = bytes(range(1, 255))
    assert unstuffed(b"\xff" + run) == unstuffed(b"\xff" + run + b"\x01") == run
    assert unstuffed(stuffed(run + b"\0")) == run + b"\0"
    assert unstuffed(stuffed(run + b"\xff")) == run + b"\xff"


def test_the_check_sum_is_the_published_one() -> None:
    """The check value of CRC-16/IBM-3740 in the catalogue of CRC algorithms (reveng) is 0x29B1."""
    assert crc_16(b"123456789") == 0x29B1
    line = line_bytes(SerialFrame(SerialKind.COMMAND, 7, b"\0D\0"))
    content = unstuffed(line[1:-1])
    assert content == b"\x01\x07\0D\0" + crc_16(b"\x01\x07\0D\0").to_bytes(2, "big")


@given(st.binary(max_size=1200))
def test_stuffed_content_has_no_border_and_is_the_same_again(content: bytes) -> None:
    line = stuffed(content)
    assert 0 not in line
    assert unstuffed(line) == content
    assert len(line) <= len(content) + 1 + len(content) // 254


@given(st.lists(FRAMES, max_size=4), st.binary(max_size=40), st.lists(st.integers(0, 3000), max_size=6))
def test_frames_after_noise_in_any_pieces_arrive_whole_and_in_order(
    frames: list[SerialFrame], noise: bytes, cuts: list[int]
) -> None:
    line = noise + b"".join(map(line_bytes, frames))
    reader, got, places = FrameReader(), list[SerialFrame](), [0, *sorted(cuts), len(line)]
    for begin, end in itertools.pairwise(places):
        got += reader.feed(line[begin:end])
    assert got[len(got) - len(frames) :] == frames


@given(FRAMES, FRAMES, st.data())
def test_a_frame_that_was_cut_off_is_left_out_and_the_next_one_is_read(
    cut: SerialFrame, whole: SerialFrame, data: st.DataObject
) -> None:
    line = line_bytes(cut)
    begun = line[: data.draw(st.integers(0, len(line) - 2))]
    assert read(begun + line_bytes(whole)) == [whole]


@given(FRAMES, st.data())
def test_a_frame_with_one_wrong_bit_is_left_out(frame: SerialFrame, data: st.DataObject) -> None:
    """A wrong code byte can move zeros, of which the check sum finds all but one in 65536."""
    line = bytearray(line_bytes(frame))
    bit = data.draw(st.integers(8, 8 * (len(line) - 1) - 1))
    line[bit // 8] ^= 1 << bit % 8
    assert read(bytes(line)) == []


def test_a_line_of_noise_fills_no_memory_and_a_frame_after_it_is_read() -> None:
    reader, frame = FrameReader(), SerialFrame(SerialKind.REPLY, 3, b"R")
    for _ in range(100):
        assert [*reader.feed(bytes([1]) * 4096)] == []
    assert len(reader._begun) <= 8192  # noqa: SLF001
    assert [*reader.feed(line_bytes(frame))] == [frame]


@pytest.mark.parametrize("line", [b"\0\0\0", b"\0\x01\0", b"\0\x03\x01\x02\0", b"\0\xff\x01\0"])
def test_what_is_too_short_is_no_frame(line: bytes) -> None:
    assert read(line) == []


def test_a_frame_longer_than_a_payload_may_be_is_left_out() -> None:
    longest = SerialFrame(SerialKind.REPLY, 3, bytes(MOST_PAYLOAD_BYTES))
    assert read(line_bytes(longest)) == [longest]
    assert read(line_bytes(SerialFrame(SerialKind.REPLY, 3, bytes(MOST_PAYLOAD_BYTES + 1)))) == []


def test_a_frame_of_an_unknown_kind_is_left_out() -> None:
    content = b"\x09\x07H"
    line = b"\0" + stuffed(content + crc_16(content).to_bytes(2, "big")) + b"\0"
    assert read(line) == []
