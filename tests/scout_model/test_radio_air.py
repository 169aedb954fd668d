"""Packets on the air: each arrives once, in time, at its own robot, or is lost by a die of its own."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model.air import LIGHT_M_PER_S, packet_loss
from scout_model.description import CLEAN_AIR, AirDescription
from scout_model.radio_air import RadioAir, Sent
from scout_model.radio_link import encode_drive, encode_halt, packet_bits

HALT = encode_halt()


def packet(number: int, network_id: int = 1, begun_s: float = 0.0, radio: str = "radio") -> Sent:
    return Sent(radio, number, network_id, HALT, begun_s, 0.001)


def fates(air: RadioAir, packets: list[Sent], away_m: float | None) -> set[tuple[str, int]]:
    for sent in packets:
        air.send(sent, away_m)
    return {(sent.radio, sent.number) for sent in air.arrived(1e9)}


def test_a_packet_arrives_after_its_air_time_its_way_and_the_robots_delay() -> None:
    air = RadioAir(1, AirDescription(radio_delay_s=0.004))
    air.send(packet(0, begun_s=5.0), 9.0)
    at_s = 5.0 + 0.001 + 9.0 / LIGHT_M_PER_S + 0.004
    assert air.arrived(at_s - 1e-6) == []
    assert [sent.number for sent in air.arrived(at_s + 1e-9)] == [0]
    assert air.arrived(1e9) == []


def test_in_clean_air_nothing_is_lost_at_any_distance() -> None:
    assert len(fates(RadioAir(1, CLEAN_AIR), [packet(number) for number in range(500)], 400.0)) == 500


def test_across_a_room_every_packet_arrives_across_a_street_few_do() -> None:
    packets = [packet(number) for number in range(2000)]
    arrived = {away_m: len(fates(RadioAir(1, AirDescription()), packets, away_m)) for away_m in (1.0, 11.0, 40.0, 80.0)}
    assert arrived[1.0] == arrived[11.0] == 2000
    assert 1000 < arrived[40.0] < 2000
    assert arrived[80.0] < 100


@given(st.floats(0.1, 300), st.floats(0.1, 300), st.integers(8, 400), st.integers(8, 400))
def test_loss_grows_with_distance_and_length(one_m: float, other_m: float, one_bits: int, other_bits: int) -> None:
    near_m, far_m = sorted((one_m, other_m))
    short, long = sorted((one_bits, other_bits))
    assert 0.0 <= packet_loss(near_m, short) <= packet_loss(far_m, short) <= packet_loss(far_m, long) <= 1.0


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.5, 1.0])
def test_the_share_that_is_lost_anywhere_is_as_described_and_all_are_counted(loss: float) -> None:
    air = RadioAir(1, AirDescription(radio_loss=loss))
    arrived = len(fates(air, [packet(number) for number in range(2000)], 2.0))
    assert 1 - arrived / 2000 == pytest.approx(loss, abs=0.04)
    assert (air.delivered.get(1, 0), air.lost.get(1, 0)) == (arrived, 2000 - arrived)


def test_packets_to_an_id_nobody_has_reach_nobody_and_are_counted() -> None:
    air = RadioAir(1, AirDescription())
    assert fates(air, [packet(number, network_id=200) for number in range(7)], None) == set()
    assert (air.for_no_robot, dict(air.delivered), dict(air.lost)) == (7, {}, {})


@given(
    ids=st.lists(st.integers(1, 5), min_size=1, max_size=60),
    seed=st.integers(-(2**40), 2**40),
    loss=st.floats(0, 1),
)
def test_each_packet_arrives_at_most_once_at_its_own_id_with_its_own_payload(
    ids: list[int], seed: int, loss: float
) -> None:
    air = RadioAir(seed, AirDescription(radio_loss=loss))
    packets = [
        Sent("radio", number, network_id, encode_drive(number, network_id), number / 100, 0.001)
        for number, network_id in enumerate(ids)
    ]
    for sent in packets:
        air.send(sent, 3.0)
    arrived = air.arrived(1e9)
    assert len(set(arrived)) == len(arrived)
    assert set(arrived) <= set(packets)
    assert Counter(sent.network_id for sent in arrived) == Counter(dict(air.delivered))
    assert sum(air.delivered.values()) + sum(air.lost.values()) == len(packets)


@given(begins_ms=st.lists(st.integers(0, 10_000), max_size=40), looks_s=st.lists(st.floats(0, 12), max_size=10))
def test_packets_arrive_in_the_order_of_their_times_however_often_one_looks(
    begins_ms: list[int], looks_s: list[float]
) -> None:
    begins_s = [begin_ms / 1000 for begin_ms in begins_ms]
    air = RadioAir(1, CLEAN_AIR)
    for number, begun_s in enumerate(begins_s):
        air.send(packet(number, network_id=number + 1, begun_s=begun_s), 3.0)  # to different robots
    arrived = [sent.begun_s for at_s in [*sorted(looks_s), 100.0] for sent in air.arrived(at_s)]
    assert arrived == sorted(begins_s)


@given(loss=st.floats(0, 1), others=st.lists(st.integers(0, 200), unique=True, max_size=50))
def test_another_radio_changes_the_fate_of_no_packet(loss: float, others: list[int]) -> None:
    packets = [packet(number) for number in range(50)]
    alone = fates(RadioAir(9, AirDescription(radio_loss=loss)), packets, 3.0)
    beside = RadioAir(9, AirDescription(radio_loss=loss))
    mixed = fates(beside, [*(packet(number, radio="other") for number in others), *packets], 3.0)
    assert {fate for fate in mixed if fate[0] == "radio"} == alone


def test_the_same_seed_loses_the_same_packets_another_seed_others() -> None:
    packets = [packet(number) for number in range(200)]
    one, again, other = (fates(RadioAir(seed, AirDescription(radio_loss=0.5)), packets, 3.0) for seed in (1, 1, 2))
    assert one == again != other


def test_a_packets_bits_are_those_of_its_head_and_its_payload() -> None:
    assert packet_bits(HALT) == 40
    assert packet_bits(encode_drive(1.0, 2.0)) == 120


@given(st.integers(0, 10_000), st.sets(st.integers(0, 39)))
def test_the_fate_of_a_reply_depends_on_no_other_reply(seed: int, replied: set[int]) -> None:
    air = AirDescription(radio_loss=0.5)
    alone = fates(RadioAir(seed, air, "reply to "), [packet(number) for number in replied], 2.0)
    among_all = fates(RadioAir(seed, air, "reply to "), [packet(number) for number in range(40)], 2.0)
    assert alone == {(radio, number) for radio, number in among_all if number in replied}


def test_the_reply_to_a_packet_that_arrived_can_be_lost() -> None:
    packets = [packet(number) for number in range(2000)]
    air = AirDescription(radio_loss=0.5)
    there = fates(RadioAir(1, air), packets, 2.0)
    back = fates(RadioAir(1, air, "reply to "), [sent for sent in packets if (sent.radio, sent.number) in there], 2.0)
    assert len(back) / len(there) == pytest.approx(0.5, abs=0.05)


@given(st.lists(st.tuples(st.integers(1, 3), st.floats(0.0, 0.01), st.floats(0.0, 0.01)), min_size=1))
def test_no_packet_to_a_robot_overtakes_an_earlier_one(packets: list[tuple[int, float, float]]) -> None:
    """A world that hears two packets at the same late moment must not let the short one, a halt, arrive first."""
    air, begun_s = RadioAir(1, CLEAN_AIR), 0.0
    for number, (network_id, pause_s, air_time_s) in enumerate(packets):
        begun_s += pause_s
        air.send(Sent("radio", number, network_id, HALT, begun_s, air_time_s), 3.0)
    arrived = air.arrived(1000.0)
    for network_id in {sent.network_id for sent in arrived}:
        numbers = [sent.number for sent in arrived if sent.network_id == network_id]
        assert numbers == sorted(numbers)


def test_a_packet_of_absurd_length_keeps_no_later_one_from_its_robot() -> None:
    air = RadioAir(1, CLEAN_AIR)
    air.send(Sent("radio", 0, 1, HALT, 0.0, 86_400.0), 3.0)
    air.send(Sent("radio", 1, 1, HALT, 0.1, 0.002), 3.0)
    assert [sent.number for sent in air.arrived(0.2)] == [1]
