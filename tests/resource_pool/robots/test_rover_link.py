"""The rover's packets: what is put in comes out, and what is none is refused."""

import math
from dataclasses import replace
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.rover import link
from resource_pool.robots.rover.link import Bumpers, GripPacket, MovePacket, RoverReply, StopPacket
from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

milli = st.integers(-32768, 32767).map(lambda number: number / 1000)
shares = st.integers(0, 255).map(radio_link.byte_to_share)
ways_m = st.integers(-(2**31), 2**31 - 1).map(lambda number: number / 1000)
names = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=15)
packets = st.one_of(
    st.builds(MovePacket, milli, milli),
    st.builds(GripPacket, shares, shares),
    st.builds(TransmitterOn, names),
    st.sampled_from([StopPacket(), HaltPacket(), TransmitterOff(), Safe()]),
)
replies = st.builds(
    RoverReply,
    battery=shares,
    left_m=ways_m,
    right_m=ways_m,
    sonars_cm=st.tuples(*[st.integers(0, link.MOST_CM)] * link.SONARS),
    bumpers=st.builds(Bumpers, st.booleans(), st.booleans(), st.booleans(), st.booleans()),
    is_blocked=st.booleans(),
    gyroscope_rad_s=st.tuples(milli, milli, milli),
    acceleration_m_s2=st.tuples(milli, milli),
    closed=shares,
    lift=shares,
    is_holding=st.booleans(),
)


@given(packets)
def test_a_packet_says_what_was_put_in(packet: link.Packet) -> None:
    assert isinstance(packet, get_args(link.Packet))
    assert link.decode(link.encode(packet)) == packet


@given(replies)
def test_an_answer_says_what_was_put_in_with_forty_bytes_at_most(reply: RoverReply) -> None:
    payload = link.encode_reply(reply)
    assert link.decode_reply(payload) == reply
    assert len(payload) <= 40


@given(st.floats(-32, 32), st.floats(-32, 32), st.floats(0, 1))
def test_numbers_are_rounded_by_less_than_a_thousandth(forward_m_s: float, turn_rad_s: float, share: float) -> None:
    move = link.decode(link.encode(MovePacket(forward_m_s, turn_rad_s)))
    assert isinstance(move, MovePacket)
    assert (move.forward_m_s, move.turn_rad_s) == pytest.approx((forward_m_s, turn_rad_s), abs=5.1e-4)
    grip = link.decode(link.encode(GripPacket(share, 1 - share)))
    assert isinstance(grip, GripPacket)
    assert (grip.closed, grip.lift) == pytest.approx((share, 1 - share), abs=2e-3)


@given(st.one_of(st.binary(max_size=20), st.binary(max_size=8).map(lambda rest: b"MGV"[len(rest) % 3 :][:1] + rest)))
def test_any_bytes_are_a_packet_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        packet = link.decode(payload)
    except MalformedPacket:
        return
    assert link.encode(packet) == payload


@given(st.one_of(st.binary(max_size=45), st.binary(min_size=38, max_size=38).map(lambda rest: b"R" + rest)))
def test_any_bytes_are_an_answer_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        reply = link.decode_reply(payload)
    except MalformedPacket:
        return
    assert link.encode_reply(reply) == payload


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"M",
        b"M" + bytes(3),
        b"M" + bytes(5),
        b"G",
        b"G" + bytes(3),
        b"H!",
        b"?",
        radio_link.encode_drive(1.0, 1.0),
        radio_link.encode_jump(),
    ],
)
def test_malformed_bytes_and_what_only_a_scout_can_do_are_refused(payload: bytes) -> None:
    with pytest.raises(MalformedPacket):
        link.decode(payload)


@pytest.mark.parametrize(
    "packet",
    [
        MovePacket(math.nan, 0.0),
        MovePacket(0.0, math.inf),
        MovePacket(33.0, 0.0),
        MovePacket(0.0, 1e306),
        GripPacket(-0.1, 0.0),
        GripPacket(0.0, math.nan),
    ],
)
def test_impossible_packets_are_never_sent(packet: link.Packet) -> None:
    with pytest.raises(MalformedPacket):
        link.encode(packet)


NOTHING = RoverReply(
    0.0, 0.0, 0.0, (0,) * 8, Bumpers(False, False, False, False), False, (0.0, 0.0, 0.0), (0.0, 0.0), 0.0, 0.0, False
)


def test_a_blow_beyond_what_a_field_holds_reads_as_its_largest_and_the_odometer_begins_anew() -> None:
    wild = replace(NOTHING, gyroscope_rad_s=(1e6, -1e6, 0.0), acceleration_m_s2=(1e9, -1e9), left_m=2147483.648)
    reply = link.decode_reply(link.encode_reply(wild))
    assert reply.gyroscope_rad_s == (32.767, -32.768, 0.0)
    assert reply.acceleration_m_s2 == (32.767, -32.768)
    assert reply.left_m == -2147483.648


@pytest.mark.parametrize(
    "wrong", [{"battery": 1.1}, {"sonars_cm": (0,) * 7}, {"sonars_cm": (501,) * 8}, {"left_m": math.nan}]
)
def test_an_impossible_answer_is_never_sent(wrong: dict[str, object]) -> None:
    with pytest.raises(MalformedPacket):
        link.encode_reply(replace(NOTHING, **wrong))
