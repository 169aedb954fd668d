"""The walker's packets say what was put in, and what is no packet is refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.walker import link
from resource_pool.robots.walker.link import ANGLE_RAD, JOINTS, LONGEST_S, TICK_S, TURN_RAD_S, JointTargets, Status
from scout_model import radio_link
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

angles = st.floats(-3.2, 3.2)
twelve = st.lists(angles, min_size=12, max_size=12).map(tuple)
statuses = st.builds(
    Status,
    battery=st.floats(0.0, 1.0),
    roll_rad=angles,
    pitch_rad=angles,
    turn_rad_s=st.floats(-32.0, 32.0),
    joints_rad=twelve,
    on_floor=st.tuples(*[st.booleans()] * 4),
)


@given(twelve, st.floats(0.0, LONGEST_S))
def test_a_packet_of_joint_targets_says_what_was_put_in(targets_rad: tuple[float, ...], within_s: float) -> None:
    packet = link.decode(link.encode_joint_targets(JointTargets(targets_rad, within_s)))
    assert isinstance(packet, JointTargets)
    assert packet.targets_rad == pytest.approx(targets_rad, abs=0.51 * ANGLE_RAD)
    assert packet.within_s == pytest.approx(within_s, abs=0.51 * TICK_S)


@given(statuses)
def test_a_status_says_what_was_put_in(status: Status) -> None:
    again = link.decode_status(link.encode_status(status))
    assert again.battery == pytest.approx(status.battery, abs=0.51 / 255)
    assert (again.roll_rad, again.pitch_rad, *again.joints_rad) == pytest.approx(
        (status.roll_rad, status.pitch_rad, *status.joints_rad), abs=0.51 * ANGLE_RAD
    )
    assert again.turn_rad_s == pytest.approx(status.turn_rad_s, abs=0.51 * TURN_RAD_S)
    assert again.on_floor == status.on_floor


@given(st.one_of(st.binary(max_size=40), st.binary(min_size=25, max_size=25).map(lambda values: b"Q" + values)))
def test_any_bytes_are_a_packet_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        packet = link.decode(payload)
    except MalformedPacket:
        return
    if isinstance(packet, JointTargets):
        assert link.encode_joint_targets(packet) == payload
    else:
        assert packet == radio_link.decode(payload)


@given(st.one_of(st.binary(max_size=40), st.binary(min_size=32, max_size=32).map(lambda values: b"T" + values)))
def test_any_bytes_are_a_status_that_encodes_to_the_same_bytes_or_are_refused(payload: bytes) -> None:
    try:
        status = link.decode_status(payload)
    except MalformedPacket:
        return
    assert link.encode_status(status) == payload


@pytest.mark.parametrize(
    ("payload", "packet"),
    [
        (radio_link.encode_halt(), HaltPacket()),
        (radio_link.encode_safe(), Safe()),
        (radio_link.encode_transmitter_on("video1"), TransmitterOn("video1")),
        (radio_link.encode_transmitter_off(), TransmitterOff()),
    ],
)
def test_it_shares_the_packets_that_every_robot_obeys(payload: bytes, packet: object) -> None:
    assert link.decode(payload) == packet


@pytest.mark.parametrize(
    "payload", [b"", b"Q", b"Q" + bytes(24), b"Q" + bytes(26), b"?", b"J", radio_link.encode_drive(1.0, 1.0)]
)
def test_what_a_walker_cannot_do_is_refused(payload: bytes) -> None:
    with pytest.raises(MalformedPacket):
        link.decode(payload)


@pytest.mark.parametrize("payload", [b"", b"T", b"Q" + bytes(32), b"T" + bytes(33), b"T" + bytes(31) + b"\x10"])
def test_what_is_no_status_is_refused(payload: bytes) -> None:
    with pytest.raises(MalformedPacket):
        link.decode_status(payload)


@pytest.mark.parametrize(
    ("targets_rad", "within_s"),
    [
        ((0.0,) * 11, 0.0),
        ((float("nan"),) * 12, 0.0),
        ((float("inf"),) * 12, 0.0),
        ((3.3,) * 12, 0.0),
        ((1e306,) * 12, 0.0),
        ((0.0,) * 12, -0.1),
        ((0.0,) * 12, 1.1),
        ((0.0,) * 12, float("nan")),
    ],
)
def test_impossible_joint_targets_are_never_sent(targets_rad: tuple[float, ...], within_s: float) -> None:
    with pytest.raises(MalformedPacket):
        link.encode_joint_targets(JointTargets(targets_rad, within_s))


@pytest.mark.parametrize(
    "status",
    [
        Status(1.1, 0.0, 0.0, 0.0, (0.0,) * 12, (True,) * 4),
        Status(float("nan"), 0.0, 0.0, 0.0, (0.0,) * 12, (True,) * 4),
        Status(1.0, 4.0, 0.0, 0.0, (0.0,) * 12, (True,) * 4),
        Status(1.0, 0.0, 0.0, 0.0, (0.0,) * 13, (True,) * 4),
        Status(1.0, 0.0, 0.0, 0.0, (0.0,) * 12, (True,) * 3),
        Status(1.0, 0.0, 0.0, float("nan"), (0.0,) * 12, (True,) * 4),
    ],
)
def test_an_impossible_status_is_never_sent(status: Status) -> None:
    with pytest.raises(MalformedPacket):
        link.encode_status(status)


def test_a_turn_that_is_too_fast_for_the_link_is_clipped() -> None:
    spun = link.encode_status(Status(1.0, 0.0, 0.0, -99.0, (0.0,) * 12, (True,) * 4))
    assert link.decode_status(spun).turn_rad_s == pytest.approx(-32.768)


def test_a_packet_of_joint_targets_takes_less_than_three_milliseconds_of_the_air() -> None:
    """At 115.2 kbit/s."""
    packet = link.encode_joint_targets(JointTargets((0.0,) * len(JOINTS), 0.05))
    assert radio_link.packet_bits(packet) / 115_200 < 0.003
