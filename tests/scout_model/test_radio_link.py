import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import DrivePacket, HaltPacket, JumpPacket, Safe, TransmitterOff, TransmitterOn

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
