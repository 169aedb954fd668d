"""Laws of the radio's packet schedule."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import pytest
from examples import share
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from backbone.scheduling.requests import Usage
from backbone.scheduling.response_time import admissible, worst_response_us
from backbone.scheduling.streams import stream
from resource_pool.packet_schedule import REPORTS_KEPT, Packet, PacketSchedule, Sending

PERIODS_MS = st.sampled_from([10, 20, 25, 40, 50, 80, 100])


def packet(arc: str, network_id: int = 1, payload: bytes = b"P", epoch: int = 1) -> Packet:
    return Packet(arc, network_id, payload, b"S%d" % network_id, epoch)


def serve(schedule: PacketSchedule, from_s: float, until_s: float) -> list[tuple[float, Sending]]:
    """Send like a radio that is always on time: due packets one after the other, without a pause between."""
    sent, now_s = [], from_s
    while now_s < until_s:
        sending = schedule.take(now_s)
        if sending is not None:
            sent.append((now_s, sending))
            schedule.sent(sending, now_s, sending.air_time_s)
            now_s += sending.air_time_s
        else:
            now_s = max(now_s, schedule.next_due_s() or until_s)
    return sent


def overruns(schedule: PacketSchedule) -> dict[str, int]:
    return {arc: count.overruns for arc, count in schedule.counts().items()}


@dataclass(frozen=True)
class Asked:
    """What one ARC wants of the radio.

    Attributes:
        streams: One a kind, and the moment its first packet is loaded, milliseconds.
        once: Kind and moment of packets that are to be sent soon, milliseconds.
    """

    rank: int
    streams: list[tuple[Usage, int]]
    once: list[tuple[str, int]]


@st.composite
def demands(draw: st.DrawFn) -> dict[str, Asked]:
    found = {}
    for rank, arc in enumerate(draw(st.permutations(["a", "b", "c", "d"]))[: draw(st.integers(1, 4))]):
        streams = []
        for number in range(draw(st.integers(1, 3))):
            period_ms = draw(PERIODS_MS)
            packet_ms = draw(st.integers(1, 8))
            deadline_ms = draw(st.one_of(st.just(0), st.integers(packet_ms, 2 * period_ms)))
            usage = Usage(period_ms / 1000, packet_ms / 1000, deadline_ms / 1000, kind=f"kind{number}")
            streams.append((usage, draw(st.integers(0, 100))))
        kinds = st.sampled_from([usage.kind for usage, _ in streams])
        once = draw(st.lists(st.tuples(kinds, st.integers(0, 400)), max_size=4))
        found[arc] = Asked(rank, streams, once)
    return found


def play(schedule: PacketSchedule, asked: dict[str, Asked]) -> list[tuple[float, Sending]]:
    """Return the packets of the first half second."""
    events: list[tuple[int, str, str, bool]] = []
    for arc, wish in asked.items():
        schedule.connect(arc, [usage for usage, _ in wish.streams], wish.rank)
        events += [(at_ms, arc, usage.kind, False) for usage, at_ms in wish.streams]
        events += [(at_ms, arc, kind, True) for kind, at_ms in wish.once]
    sent: list[tuple[float, Sending]] = []
    free_s = 0.0
    for number, (at_ms, arc, kind, once) in enumerate(sorted(events)):
        sent += serve(schedule, free_s, at_ms / 1000)
        loaded = replace(packet(arc), kind=kind)
        if once:
            schedule.send_once(replace(loaded, ticket=number + 1), at_ms / 1000)
        else:
            schedule.load(loaded, at_ms / 1000)
        free_s = max(at_ms / 1000, max((at_s + one.air_time_s for at_s, one in sent), default=0.0))
    return sent + serve(schedule, free_s, 0.5)


@settings(max_examples=share(150))
@given(demands())
def test_of_admitted_streams_no_request_is_late_and_none_is_later_than_analyzed(asked: dict[str, Asked]) -> None:
    """Also when ARCs send once and soon as often as they like."""
    places = [
        (wish.rank, usage.period_s, arc, number, stream(usage))
        for arc, wish in asked.items()
        for number, (usage, _) in enumerate(wish.streams)
    ]
    places.sort(key=lambda place: place[:4])
    streams = [one for *_, one in places]
    assume(admissible(streams, 1.0))
    worst_us = {(arc, number): worst_response_us(streams, at) for at, (_, _, arc, number, _) in enumerate(places)}
    schedule = PacketSchedule()
    sent = play(schedule, asked)
    assert overruns(schedule) == dict.fromkeys(asked, 0)
    for at_s, sending in sent:
        limit_us = worst_us[sending.packet.arc, sending.number]
        assert limit_us is not None
        assert (at_s + sending.air_time_s - sending.release_s) * 1e6 <= limit_us + 1


@settings(max_examples=share(50))
@given(demands())
def test_no_stream_sends_two_packets_of_one_interval_whatever_is_sent_once(asked: dict[str, Asked]) -> None:
    releases: dict[tuple[str, int], list[float]] = {}
    for _, sending in play(PacketSchedule(), asked):
        releases.setdefault((sending.packet.arc, sending.number), []).append(sending.release_s)
    for (arc, number), times in releases.items():
        period_s = asked[arc].streams[number][0].period_s
        assert all(later - earlier >= period_s - 1e-9 for earlier, later in pairwise(times))


def test_a_request_that_ends_after_its_deadline_is_an_overrun_and_news_once() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.002, deadline_s=0.01, kind="drive")], 0)
    schedule.load(packet("one"), 0.0)
    told = []
    for at_s in (0.005, 0.109, 0.205, 0.3095):
        sending = schedule.take(at_s)
        assert sending is not None
        told += schedule.sent(sending, at_s, 0.002)
    assert overruns(schedule) == {"one": 2}
    assert len(told) == 1
    assert "drive packets are not always done within 0.01 s" in told[0]


def test_a_packet_that_takes_longer_than_declared_is_news_once_for_each_arc_and_stream() -> None:
    schedule = PacketSchedule()
    told: list[tuple[str, str]] = []
    for round_number in range(2):  # connected twice: the second time nothing is news
        begin_s = float(round_number)
        for arc in ("one", "two"):
            schedule.connect(arc, [Usage(0.1, 0.002, kind="drive"), Usage(0.1, 0.002, kind="ask")], 0)
            schedule.load(packet(arc), begin_s)
            schedule.load(replace(packet(arc), kind="ask"), begin_s)
        for step in range(8):
            at_s = begin_s + 0.1 * (step // 4) + 0.003 * (step % 4)
            sending = schedule.take(at_s)
            assert sending is not None
            slow = sending.packet.arc == "one"
            told += [(sending.packet.arc, line) for line in schedule.sent(sending, at_s, 0.003 if slow else 0.001)]
        counts = schedule.counts()
        assert (counts["one"].worst_packet_s, counts["two"].worst_packet_s) == (0.003, 0.001)
    assert [arc for arc, _ in told] == ["one", "one"]
    assert "drive packets take 3 ms on the air, 2 ms were declared" in told[0][1]
    assert "ask packets take 3 ms" in told[1][1]


def test_what_is_repeated_after_a_packet_sent_once_belongs_to_the_main_stream_and_a_newer_command_comes_before_it() -> (
    None
):
    for newer in (False, True):
        schedule = PacketSchedule()
        schedule.connect("one", [Usage(0.4, 0.001, kind="jump"), Usage(0.1, 0.001, kind="drive")], 0)
        schedule.load(replace(packet("one", payload=b"old"), kind="drive"), 0.0)
        serve(schedule, 0.0, 0.05)
        once = replace(packet("one", payload=b"jump"), kind="jump", ticket=1, afterwards=b"still")
        schedule.send_once(once, 0.06)
        if newer:
            schedule.load(replace(packet("one", payload=b"new"), kind="drive"), 0.06)
        sent = [(sending.number, sending.packet.payload) for _, sending in serve(schedule, 0.06, 0.25)]
        assert sent == [(0, b"jump"), (1, b"new" if newer else b"still"), (1, b"new" if newer else b"still")]


def test_of_a_kind_the_arc_has_no_stream_for_packets_go_in_its_first() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.001, kind="ask"), Usage(0.2, 0.001, kind="tell")], 0)
    schedule.load(replace(packet("one"), kind="sing"), 0.0)
    assert {sending.number for _, sending in serve(schedule, 0.0, 0.5)} == {0}


@given(PERIODS_MS, st.floats(0, 1000), st.floats(0, 3))
def test_the_interval_is_constant_from_the_first_packet_on(period_ms: int, connected_s: float, later_s: float) -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(period_ms / 1000, 0.001)], 0)
    first_s = connected_s + later_s
    schedule.load(packet("one"), first_s)
    times = [at_s for at_s, _ in serve(schedule, first_s, first_s + 2.0)]
    assert times[0] == first_s
    assert all(at_s == pytest.approx(first_s + nth * period_ms / 1000, abs=1e-9) for nth, at_s in enumerate(times))
    assert (schedule.counts()["one"].sent, schedule.counts()["one"].overruns) == (len(times), 0)


@given(st.lists(st.tuples(st.integers(0, 2), PERIODS_MS), min_size=1, max_size=5))
def test_of_those_due_the_higher_priority_goes_first_then_the_shorter_period_then_the_name(
    given: list[tuple[int, int]],
) -> None:
    schedule = PacketSchedule()
    arcs = {f"arc{number}": (rank, period_ms / 1000) for number, (rank, period_ms) in enumerate(given)}
    for arc, (rank, period_s) in reversed(arcs.items()):
        schedule.connect(arc, [Usage(period_s, 0.001)], rank)
        schedule.load(packet(arc), 0.0)
    order = []
    while (sending := schedule.take(0.0)) is not None:
        order.append(sending.packet.arc)
    assert order == sorted(arcs, key=lambda arc: (*arcs[arc], arc))


@given(st.sets(st.integers(1, 254), min_size=1, max_size=5), st.integers(1, 4))
def test_the_robots_of_an_arc_take_turns_by_network_id(robots: set[int], rounds: int) -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.01, 0.001)], 0)
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
        schedule.connect(arc, [Usage(0.01, 0.001)], 0)
    for arc, robot, at_once in said:
        if at_once:
            schedule.send_once(packet(arc, robot), 0.0)
        else:
            schedule.load(packet(arc, robot), 0.0)
    heard = {(s.packet.arc, s.packet.network_id) for _, s in serve(schedule, 0.0, 0.2)}
    assert heard == {(arc, robot) for arc, robot, _ in said}
    owed = schedule.disconnect(leaving)
    spoken_to = sorted({robot for arc, robot, _ in said if arc == leaving})
    assert [(s.packet.network_id, s.packet.payload) for s in owed] == [(r, b"S%d" % r) for r in spoken_to]
    assert all(sending.packet.arc != leaving for _, sending in serve(schedule, 0.3, 0.5))
    assert schedule.disconnect(leaving) == []


def test_releases_that_were_slept_through_are_counted_and_not_made_up_for() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.001)], 0)
    schedule.load(packet("one"), 0.0)
    assert schedule.take(0.35) is not None
    assert schedule.take(0.35) is None
    assert (schedule.counts()["one"].sent, schedule.counts()["one"].overruns) == (1, 3)
    assert schedule.next_due_s() == pytest.approx(0.4)


def test_the_newest_packet_replaces_the_one_before() -> None:
    schedule = PacketSchedule()
    schedule.connect("one", [Usage(0.1, 0.001)], 0)
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
            schedule.connect("one", [Usage(0.1, 0.001), usage], 0)
    assert schedule.counts() == {}


def test_what_is_not_loaded_anew_in_time_gives_way_to_what_comes_after_it() -> None:
    """A robot RC that hangs must not keep its robot moving through the radio."""
    schedule = PacketSchedule()
    schedule.connect("arc", [Usage(0.25, 0.002)], 0)
    schedule.load(Packet("arc", 1, b"drive", b"safe", 7, until_s=0.6, afterwards=b"halt"), 0.0)
    sent = [schedule.take(at_s) for at_s in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert [sending.packet.payload for sending in sent if sending] == [b"drive", b"drive", b"drive", b"halt", b"halt"]


def test_what_has_no_successor_gives_way_to_the_safe_packet() -> None:
    schedule = PacketSchedule()
    schedule.connect("arc", [Usage(0.1, 0.002)], 0)
    schedule.load(Packet("arc", 1, b"drive", b"safe", 7, until_s=0.05), 0.0)
    sent = [schedule.take(at_s / 10) for at_s in range(2)]
    assert [sending.packet.payload for sending in sent if sending] == [b"drive", b"safe"]


@given(st.lists(st.tuples(st.sampled_from(["load", "once", "take"]), st.booleans(), st.integers(0, 4)), max_size=30))
def test_nothing_that_moves_a_robot_is_sent_once_a_packet_of_a_later_stop_was_loaded(
    steps: list[tuple[str, bool, int]],
) -> None:
    schedule, newest, now_s = PacketSchedule(), 0, 0.0
    schedule.connect("arc", [Usage(0.1, 0.002, kind="drive"), Usage(0.3, 0.002, kind="jump")], 0)
    for number, (what, moves, stop) in enumerate(steps, 1):
        now_s += 0.07
        if what == "take":
            sending = schedule.take(now_s)
            assert sending is None or not (sending.packet.moves and sending.packet.robot_stop < newest)
            assert sending is None or sending.packet.robot_stop >= newest, "the audit sees numbers that never go back"
            continue
        kind = "jump" if what == "once" else "drive"
        packet = Packet("arc", 1, b"p", b"safe", 7, kind=kind, moves=moves, robot_stop=stop)
        if schedule.is_overtaken(packet):
            assert moves
            assert stop < newest
            continue
        if stop < newest:
            continue  # a robot's RC stamps what stands still with its newest number
        schedule.hear_stop(packet)
        newest = max(newest, stop)
        if what == "once":
            schedule.send_once(replace(packet, ticket=number), now_s)
        else:
            schedule.load(packet, now_s)


def test_a_packet_that_waits_for_its_turn_is_dropped_and_what_stands_still_is_kept() -> None:
    schedule = PacketSchedule()
    schedule.connect("arc", [Usage(0.1, 0.002)], 0)
    schedule.send_once(Packet("arc", 1, b"jump", b"safe", 7, ticket=1, moves=True), 0.0)
    schedule.send_once(Packet("arc", 1, b"video on", b"safe", 7, ticket=2), 0.0)
    halt = Packet("arc", 1, b"halt", b"safe", 7, robot_stop=1)
    assert schedule.hear_stop(halt) == [1]
    schedule.load(halt, 0.0)
    sent = [schedule.take(at_s / 10) for at_s in range(2)]
    assert [(one.packet.payload, one.packet.robot_stop) for one in sent if one] == [(b"video on", 1), (b"halt", 1)]


def test_of_ever_new_arcs_only_the_last_ones_are_known_to_have_been_late() -> None:
    schedule, told = PacketSchedule(), []
    for number in [*range(REPORTS_KEPT + 1), REPORTS_KEPT, 0]:
        arc, begin_s = f"console-{number}-drive", float(len(told))
        schedule.connect(arc, [Usage(0.1, 0.002, deadline_s=0.01)], 0)
        schedule.load(packet(arc), begin_s)
        sending = schedule.take(begin_s)
        assert sending is not None
        told.append(len(schedule.sent(sending, begin_s + 0.05, 0.002)))
        schedule.disconnect(arc)
    assert told == [1] * (REPORTS_KEPT + 1) + [0, 1]
