"""Slow packets: the longest time is told, at most once a second, and forgotten with the connection."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.rc_manager.messages import LONGEST_PACKET_S
from backbone.scheduling.requests import MeasuredPackets
from resource_pool.slow_packets import EVERY_S, STEP_S, SlowPackets

TIMES = st.lists(st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 0.02)), max_size=40)


@given(TIMES, st.floats(0.001, 0.01))
def test_the_longest_is_told_soon_rounded_up_and_seldom(times: list[tuple[float, float]], declared_s: float) -> None:
    packets, now_s, longest_s, told_at_s = SlowPackets(), 0.0, 0.0, [-EVERY_S]
    for pause_s, took_s in times:
        now_s, longest_s = now_s + pause_s, max(longest_s, took_s)
        if packets.took("a", "drive", declared_s, took_s, now_s):
            assert now_s >= told_at_s[-1] + EVERY_S
            told_at_s.append(now_s)
        told_s = max((one.packet_time_s for one in packets.told(["a"])), default=0.0)
        assert told_s <= longest_s + STEP_S
        assert (told_s > 0.0) is (longest_s > declared_s)
        if took_s > declared_s and now_s > told_at_s[-1] + EVERY_S:
            assert told_s >= longest_s - 1e-9


@pytest.mark.parametrize("took_s", [0.002, 0.0, -1.0, math.nan, -math.inf])
def test_what_is_not_longer_than_declared_is_not_told(took_s: float) -> None:
    packets = SlowPackets()
    assert not packets.took("a", "drive", 0.002, took_s, 1.0)
    assert packets.told(["a"]) == []


@pytest.mark.parametrize("took_s", [1e9, math.inf])
def test_no_packet_is_told_to_take_longer_than_one_can(took_s: float) -> None:
    packets = SlowPackets()
    assert packets.took("a", "drive", 0.002, took_s, 1.0)
    assert packets.told(["a"]) == [MeasuredPackets("a", "drive", LONGEST_PACKET_S)]


def test_each_kind_is_told_for_itself_and_only_of_the_arcs_asked_for() -> None:
    packets = SlowPackets()
    assert packets.took("a", "drive", 0.002, 0.0043, 1.0)
    assert packets.took("a", "transmitter", 0.002, 0.003, 1.0)
    assert packets.took("b", "drive", 0.002, 0.005, 1.0)
    assert not packets.took("a", "drive", 0.002, 0.006, 1.5), "within a second it waits"
    told = [MeasuredPackets("a", "drive", 0.0043), MeasuredPackets("a", "transmitter", 0.003)]
    assert packets.told(["a", "c"]) == told
    packets.forget("a")
    assert packets.told(["a"]) == []
    assert packets.told(["b"]) == [MeasuredPackets("b", "drive", 0.005)]
