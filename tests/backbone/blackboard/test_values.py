"""What is a packet of a value, and what is none."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.blackboard.values import HEADER, NotAValue, ValueTooLong, files_of, read_header
from backbone.errors import Refusal
from backbone.naming import IllegalName

NUMBERS = st.integers(0, 2**64 - 1)
MOST = 1000


@given(NUMBERS, st.binary(max_size=MOST))
def test_a_value_in_its_packet_is_read_as_it_was_written(number: int, value: bytes) -> None:
    assert read_header(HEADER.pack(number, len(value)) + value, 0, MOST) == (number, len(value))


@given(NUMBERS, st.integers(0, MOST))
def test_a_value_beside_its_packet_has_a_header_alone(number: int, length: int) -> None:
    assert read_header(HEADER.pack(number, length), 1, MOST) == (number, length)


@given(st.binary(max_size=64), st.integers(0, 3))
def test_any_bytes_are_a_value_or_refused(packet: bytes, descriptors: int) -> None:
    try:
        _number, length = read_header(packet, descriptors, MOST)
    except Refusal:
        return
    assert descriptors == 1 or length == len(packet) - HEADER.size


@pytest.mark.parametrize("descriptors", [0, 1])
def test_a_value_that_is_too_long_is_refused(descriptors: int) -> None:
    packet = HEADER.pack(1, MOST + 1) + bytes(0 if descriptors else MOST + 1)
    with pytest.raises(ValueTooLong, match="1001"):
        read_header(packet, descriptors, MOST)


def test_two_descriptors_are_no_value() -> None:
    with pytest.raises(NotAValue):
        read_header(HEADER.pack(1, 1), 2, MOST)


@pytest.mark.parametrize("name", ["", "../up", "Room", "a/b"])
def test_a_board_has_a_legal_name(name: str) -> None:
    with pytest.raises(IllegalName):
        files_of(name)
