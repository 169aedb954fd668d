import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import (
    DrivePacket,
    HaltPacket,
    JumpPacket,
    Safe,
    ScoutReply,
    TransmitterOff,
    TransmitterOn,
)

speeds = st.floats(allow_nan=False, allow_infinity=False, width=32)
names = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=15)


@given(speeds, speeds)
def test_a_drive_packet_says_what_was_put_in(left_rad_s: float, right_rad_s: float) -> None:
    assert radio_link.decode(radio_link.encode_drive(left_rad_s, right_rad_s)) == DrivePacket(left_rad_s, right_rad_s)


@given(names)
def test_a_transmitter_packet_says_which_frequency_was_put_in(frequency: str) -> None:
    assert radio_link.decode(radio_link.encode_transmitter_on(frequency)) == TransmitterOn(frequency)


@pytest.mark.parametrize(
    ("payload", "packet"),
    [
        (radio_link.encode_halt(), HaltPacket()),
        (radio_link.encode_jump(), JumpPacket()),
        (radio_link.encode_safe(), Safe()),
        (radio_link.encode_transmitter_off(), TransmitterOff()),
    ],
)
def test_a_command_without_values_is_one_byte(payload: bytes, packet: object) -> None:
    assert len(payload) == 1
    assert radio_link.decode(payload) == packet


@given(st.binary(max_size=40))
def test_any_bytes_are_a_packet_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        packet = radio_link.decode(payload)
    except MalformedPacket:
        return
    match packet:
        case DrivePacket(left_rad_s, right_rad_s):
            again = radio_link.encode_drive(left_rad_s, right_rad_s)
        case TransmitterOn(frequency):
            again = radio_link.encode_transmitter_on(frequency)
        case _:
            again = payload[:1]
    assert again == payload


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"D",
        b"D" + bytes(7),
        b"D" + bytes(9),
        b"D\x7f\xc0\x00\x00" + bytes(4),
        b"H!",
        b"V",
        b"V" + b"a" * 16,
        b"Vno space",
        b"V\xff",
        b"?",
    ],
)
def test_malformed_bytes_are_refused(payload: bytes) -> None:
    with pytest.raises(MalformedPacket, match=r"encode functions"):
        radio_link.decode(payload)


@pytest.mark.parametrize("speed_rad_s", [float("nan"), float("inf"), 1e300])
def test_impossible_speeds_are_never_sent(speed_rad_s: float) -> None:
    with pytest.raises(MalformedPacket):
        radio_link.encode_drive(speed_rad_s, 0.0)


@pytest.mark.parametrize("frequency", ["", "sixteen_letters_", "grün", "two words"])
def test_impossible_frequency_names_are_never_sent(frequency: str) -> None:
    with pytest.raises(MalformedPacket):
        radio_link.encode_transmitter_on(frequency)


@given(st.floats(0, 1), st.floats(0, math.pi), st.floats(0, 1))
def test_an_answer_says_what_was_put_in_to_a_255th(battery: float, tilt_rad: float, load: float) -> None:
    payload = radio_link.encode_reply(ScoutReply(battery, tilt_rad, load))
    told = radio_link.decode_reply(payload)
    assert (told.battery, told.load) == pytest.approx((battery, load), abs=0.501 / 255)
    assert told.tilt_rad == pytest.approx(tilt_rad, abs=0.501 * math.pi / 255)
    assert radio_link.encode_reply(told) == payload


@given(st.one_of(st.binary(max_size=8), st.binary(min_size=3, max_size=3).map(lambda rest: b"R" + rest)))
def test_any_bytes_are_an_answer_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        told = radio_link.decode_reply(payload)
    except MalformedPacket:
        assert len(payload) != 4 or payload[:1] != b"R"
        return
    assert radio_link.encode_reply(told) == payload


@pytest.mark.parametrize("wrong", [ScoutReply(1.1, 0, 0), ScoutReply(0, -0.1, 0), ScoutReply(0, 0, math.nan)])
def test_impossible_answers_are_never_sent(wrong: ScoutReply) -> None:
    with pytest.raises(MalformedPacket):
        radio_link.encode_reply(wrong)
