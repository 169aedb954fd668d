"""Laws of the radio's packet schedule."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from backbone.rc_manager.messages import Usage
from backbone.rc_manager.radio_admission import admissible, stream
from resource_pool.packet_schedule import Packet, PacketSchedule, Sending

PERIODS_MS = st.sampled_from([10, 20, 25, 40, 50, 80, 100])


def packet(arc: str, network_id: int = 1, payload: bytes = b"P", epoch: int = 1) -> Packet:
    return Packet(arc, network_id, payload, b"S%d" % network_id, epoch)


def serve(schedule: PacketSchedule, from_s: float, until_s: float) -> list[tuple[float, Sending]]:
    """Send like a radio that is always on time: what is due, one after the other, without a pause between."""
    sent, now_s = [], from_s
    while True:
        sending = schedule.take(now_s)
        if sending is not None:
            sent.append((now_s, sending))
            now_s += sending.air_time_s
        else:
            due_s = schedule.next_due_s()
            if due_s is None or due_s >= until_s:
                return sent
            now_s = max(now_s, due_s)
        if now_s >= until_s:
            return sent


@st.composite
def senders(draw: st.DrawFn) -> dict[str, tuple[int, list[Usage]]]:
    found = {}
    for rank, arc in enumerate(draw(st.permutations(["a", "b", "c", "d"]))[: draw(st.integers(1, 4))]):
        streams = [
            Usage(draw(PERIODS_MS) / 1000, draw(st.integers(1, 8)) / 1000) for _ in range(draw(st.integers(1, 2)))
        ]
        found[arc] = (rank, streams)
    return found


@given(senders(), st.lists(st.floats(0, 0.1), min_size=4, max_size=4))
def test_admitted_streams_served_on_time_never_overrun(
    asked: dict[str, tuple[int, list[Usage]]], phases_s: list[float]
) -> None:
    places = [(rank, usage.period_s, arc, usage) for arc, (rank, usages) in asked.items() for usage in usages]
    places.sort(key=lambda place: place[:3])
    assume(admissible([stream(usage) for *_, usage in places], 0.95))
    schedule = PacketSchedule()
    for (arc, (rank, usages)), first_s in zip(asked.items(), phases_s, strict=False):
        schedule.connect(arc, usages, rank, 0.0)
        schedule.load(packet(arc), first_s)
    serve(schedule, 0.0, 2.0)
    assert {arc: overruns for arc, (_, overruns) in schedule.counts().items()} == dict.fromkeys(asked, 0)


@given(PERIODS_MS, st.floats(0, 1000), st.floats(0, 3))
def test_the_interval_is_constant_from_the_first_packet_on(period_ms: int, connected_s: float, later_s: float) -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(period_ms / 1000, 0.001)], 0, connected_s)
    first_s = connected_s + later_s
    schedule.load(packet("one"), first_s)
    times = [at_s for at_s, _ in serve(schedule, first_s, first_s + 2.0)]
    assert times[0] == first_s
    assert all(at_s == pytest.approx(first_s + nth * period_ms / 1000, abs=1e-9) for nth, at_s in enumerate(times))
    assert schedule.counts()["one"] == (len(times), 0)


@given(st.lists(st.tuples(st.integers(0, 2), PERIODS_MS), min_size=1, max_size=5))
def test_of_those_due_the_higher_priority_goes_first_then_the_shorter_period_then_the_name(
    given: list[tuple[int, int]],
) -> None:
    schedule = PacketSchedule()
    arcs = {f"arc{number}": (rank, period_ms / 1000) for number, (rank, period_ms) in enumerate(given)}
    for arc, (rank, period_s) in reversed(arcs.items()):
        schedule.connect(arc, [Usage(period_s, 0.001)], rank, 0.0)
        schedule.load(packet(arc), 0.0)
    order = []
    while (sending := schedule.take(0.0)) is not None:
        order.append(sending.packet.arc)
    assert order == sorted(arcs, key=lambda arc: (*arcs[arc], arc))


@given(st.sets(st.integers(1, 254), min_size=1, max_size=5), st.integers(1, 4))
def test_the_robots_of_an_arc_take_turns_by_network_id(robots: set[int], rounds: int) -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.01, 0.001)], 0, 0.0)
    for robot in robots:
        schedule.load(packet("one", robot), 0.0)
    count = len(robots) * rounds
    sent = [sending.packet.network_id for _, sending in serve(schedule, 0.0, (count - 0.5) * 0.01)]
    assert sent == sorted(robots) * rounds


@given(st.lists(st.tuples(st.sampled_from("ab"), st.integers(1, 4), st.booleans()), max_size=12), st.sampled_from("ab"))
def test_safe_packets_are_owed_exactly_to_the_robots_spoken_to_and_nobody_else_hears_anything(
    said: list[tuple[str, int, bool]], leaving: str
) -> None:
    schedule = PacketSchedule()
    for arc in "ab":
        schedule.connect(arc, [Usage(0.01, 0.001)], 0, 0.0)
    for arc, robot, at_once in said:
        if at_once:
            schedule.touch(packet(arc, robot))
        else:
            schedule.load(packet(arc, robot), 0.0)
    loaded = {(arc, robot) for arc, robot, at_once in said if not at_once}
    heard = {(s.packet.arc, s.packet.network_id) for _, s in serve(schedule, 0.0, 0.2)}
    assert heard == loaded
    owed = schedule.disconnect(leaving)
    spoken_to = sorted({robot for arc, robot, _ in said if arc == leaving})
    assert [(s.packet.network_id, s.packet.payload) for s in owed] == [(r, b"S%d" % r) for r in spoken_to]
    assert all(sending.packet.arc != leaving for _, sending in serve(schedule, 0.3, 0.5))
    assert schedule.disconnect(leaving) == []


def test_releases_that_were_slept_through_are_counted_and_not_made_up_for() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.001)], 0, 0.0)
    schedule.load(packet("one"), 0.0)
    assert schedule.take(0.35) is not None
    assert schedule.take(0.35) is None
    assert schedule.counts()["one"] == (1, 3)
    assert schedule.next_due_s() == pytest.approx(0.4)


def test_the_newest_packet_replaces_the_one_before() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.001)], 0, 0.0)
    schedule.load(packet("one", payload=b"old"), 0.0)
    schedule.load(packet("one", payload=b"new"), 0.05)
    sending = schedule.take(0.05)
    assert sending is not None
    assert sending.packet.payload == b"new"


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_stream_that_is_no_stream_is_refused_and_changes_nothing(wrong: float) -> None:
    schedule = PacketSchedule()
    for usage in (Usage(wrong, 0.001), Usage(0.1, wrong)):
        with pytest.raises(ValueError, match="packets of"):
            schedule.connect("one", [Usage(0.1, 0.001), usage], 0, 0.0)
    assert schedule.counts() == {}


def test_what_is_not_loaded_anew_in_time_gives_way_to_what_comes_after_it() -> None:
    """A robot RC that hangs must not keep its robot moving through the radio."""
    schedule = PacketSchedule()
    schedule.connect("arc", [Usage(0.25, 0.002)], 0, 0.0)
    schedule.load(Packet("arc", 1, b"drive", b"safe", 7, until_s=0.6, afterwards=b"halt"), 0.0)
    sent = [schedule.take(at_s) for at_s in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert [sending.packet.payload for sending in sent if sending] == [b"drive", b"drive", b"drive", b"halt", b"halt"]


def test_what_has_no_successor_gives_way_to_the_safe_packet() -> None:
    schedule = PacketSchedule()
    schedule.connect("arc", [Usage(0.1, 0.002)], 0, 0.0)
    schedule.load(Packet("arc", 1, b"drive", b"safe", 7, until_s=0.05), 0.0)
    sent = [schedule.take(at_s / 10) for at_s in range(2)]
    assert [sending.packet.payload for sending in sent if sending] == [b"drive", b"safe"]
