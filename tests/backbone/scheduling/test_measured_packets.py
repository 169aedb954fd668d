"""Packets that take longer than declared: the longer time counts, and no one is admitted whom it does not let fit."""

from __future__ import annotations

import copy
import math
from random import Random
from typing import Any

import pytest
from examples import share
from hypothesis import example, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from random_missions import END_S, play, random_mission
from simulated_switches import Bench, ask, load, manager, sharable, unit
from test_scheduling_laws import violations
from trace_checker.admission import admissible, stream_of
from trace_judge import judge

from backbone.ranges import A_DAY_S
from backbone.scheduling.events import (
    CapacityChanged,
    ConnectArc,
    Departed,
    Event,
    Idled,
    Instruction,
    PacketsMeasured,
    PriorityChanged,
    Requested,
    RevokeArc,
    RuntimeChanged,
    Wanted,
)
from backbone.scheduling.packet_times import PacketTimes
from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.requests import CapacityExceeded, MeasuredPackets, RcUse, Usage
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.shares import Shares

seeds = st.integers(0, 2**32)
RULES: list[dict[str, Any]] = [{}, {}, {"tolerance_s": 0.05}, {"grid_s": 2.0}, {"discipline": "time"}]


def measured(arc: str, packet_s: float, *, rc: str = "r", kind: str = "") -> PacketsMeasured:
    return PacketsMeasured(rc, [MeasuredPackets(arc, kind, packet_s)])


def uses_of(bench: Bench, arc: str) -> dict[str, RcUse]:
    return bench.answers.attributes(arc).requests[0].uses


def packet_s(bench: Bench, arc: str, rc: str = "r") -> float:
    return uses_of(bench, arc)[rc].streams[0].packet_time_s


def revoked(bench: Bench) -> list[tuple[float, str, str]]:
    return [(at_s, one.arc, one.why) for at_s, one in bench.instructions if isinstance(one, RevokeArc)]


def test_a_newcomer_that_fits_only_by_what_was_declared_waits_for_the_slice_of_who_declared_too_little():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.at(1.0, measured("a", 0.07))
    bench.at(2.0, ask("b", {"r": load(0.4)}))
    bench.run(20.0)
    assert revoked(bench)[0] == (2.0, "a", "packets"), "until then nobody needed the room"
    assert bench.runs("b")[0] == (2.0, 7.0)
    assert bench.runs("a")[:2] == [(0.0, 2.0), (7.0, 12.0)]
    assert packet_s(bench, "a") == 0.07
    assert bench.verdict() == []


def test_who_waits_asks_anew_at_once():
    bench = Bench(manager(), sharable("r"), unit("v"))
    bench.tell(ask("b", {"r": load(0.4), "v": RcUse()}))
    bench.tell(ask("a", {"r": load(0.4), "v": RcUse()}))
    bench.at(1.0, measured("a", 0.05))
    bench.run(1.0)
    assert packet_s(bench, "a") == 0.05
    assert revoked(bench) == []
    bench.run(20.0)
    assert bench.runs("a")[0] == (5.0, 10.0)
    assert bench.verdict() == []


def test_holders_that_are_late_together_are_reduced_at_once_and_only_who_declared_too_little_goes():
    bench = Bench(manager(), sharable("r"))
    for name in ("a", "b", "c"):
        bench.tell(ask(name, {"r": load(0.3)}))
    bench.at(1.0, measured("b", 0.05))
    bench.run(1.0)
    assert revoked(bench) == [(1.0, "b", "packets")]
    bench.run(20.0)
    assert bench.runs("a")[0][0] == bench.runs("c")[0][0] == 0.0
    assert min(len(bench.runs(name)) for name in "abc") >= 2, "they take turns by the usual rules"
    assert bench.verdict() == []


def test_who_fits_beside_the_others_also_with_the_longer_time_is_never_revoked():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.2)}))
    bench.at(1.0, measured("a", 0.04))
    bench.at(2.0, ask("b", {"r": load(0.4)}))
    bench.run(30.0)
    assert revoked(bench) == []
    assert (bench.runs("a"), bench.runs("b")) == ([(0.0, None)], [(2.0, None)])


def test_at_the_end_of_its_slice_an_arc_asks_anew_also_where_all_fits():
    bench = Bench(manager(), sharable("r"), unit("v"))
    bench.tell(ask("a", {"r": load(0.3), "v": RcUse()}))
    bench.tell(ask("b", "v"))
    bench.at(1.0, measured("a", 0.05))
    bench.run(4.9)
    assert packet_s(bench, "a") == pytest.approx(0.03)
    bench.run(6.0)
    assert packet_s(bench, "a") == 0.05
    assert [why for _, _, why in revoked(bench)] == ["slice"]
    bench.run(20.0)
    assert bench.runs("a")[:2] == [(0.0, 5.0), (10.0, 15.0)]
    assert bench.verdict() == []


def test_what_a_lower_one_needs_is_not_taken_from_a_higher_one():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("high", {"r": load(0.4)}, priority=2))
    bench.at(1.0, measured("high", 0.07))
    bench.at(2.0, ask("low", {"r": load(0.4)}))
    bench.run(30.0)
    assert bench.runs("high") == [(0.0, 2.0), (2.0, None)], "it asked anew, and was first again"
    assert bench.runs("low") == []
    assert bench.verdict() == []


def test_who_leaves_is_measured_anew():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}, idle=True))
    bench.tell(measured("a", 0.07))
    bench.tell(Wanted("a"))
    assert packet_s(bench, "a") == 0.07
    bench.tell(Departed("a"))
    bench.run(1.0)
    bench.tell(ask("a", {"r": load(0.4)}))
    assert packet_s(bench, "a") == pytest.approx(0.04)
    assert bench.verdict() == []


def test_the_same_request_again_changes_nothing_and_a_longer_declaration_counts():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.tell(measured("a", 0.05))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.run(3.0)
    assert revoked(bench) == []
    bench.tell(ask("a", {"r": load(0.6)}))
    bench.run(4.0)
    assert packet_s(bench, "a") == pytest.approx(0.06)
    assert bench.verdict() == []


def test_what_it_asked_for_meanwhile_counts_when_it_asks_anew():
    bench = Bench(manager(), sharable("r", disconnect_s=0.5))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.tell(ask("b", {"r": load(0.4)}))
    bench.at(1.0, measured("b", 0.07))
    bench.at(1.2, RuntimeChanged("b", 2.0, 3.0))
    bench.run(1.2)
    bench.tell(Idled("b"))
    bench.run(3.0)
    [request] = bench.answers.attributes("b").requests
    assert (request.minimum_runtime_s, request.maximum_runtime_s, request.state) == (2.0, 3.0, "idle")
    assert bench.verdict() == []


def test_only_the_measured_kind_of_packets_is_longer():
    bench = Bench(manager(), sharable("r"))
    streams = [Usage(0.1, 0.002, kind="drive"), Usage(0.2, 0.003, kind="transmitter")]
    bench.tell(ask("a", {"r": RcUse(streams)}, idle=True))
    told = [("a", "transmitter", 0.004), ("a", "jump", 0.9), ("nobody", "drive", 0.9)]
    bench.tell(PacketsMeasured("r", [MeasuredPackets(*one) for one in told]))
    bench.tell(Wanted("a"))
    assert [usage.packet_time_s for usage in uses_of(bench, "a")["r"].streams] == [0.002, 0.004]


def test_why_says_what_is_measured_and_what_was_declared():
    bench = Bench(manager(), sharable("radio"))
    bench.tell(ask("a", {"radio": RcUse([Usage(0.1, 0.002, kind="drive")])}))
    bench.tell(measured("a", 0.0043, rc="radio", kind="drive"))
    line = "its drive packets on radio take 4.3 ms, it declared 2: the longer time counts"
    assert f"{line} as soon as its slice ends, or another needs the room" in bench.answers.why("a", 0.0).lines
    bench.tell(Idled("a"))
    bench.run(1.0)
    bench.tell(Wanted("a"))
    assert line in bench.answers.why("a", 1.0).lines


def test_shares_count_the_measured_time():
    bench, shares = Bench(manager(), sharable("r")), Shares()
    bench.tell(ask("a", {"r": load(0.2)}, idle=True))
    bench.tell(measured("a", 0.08))
    bench.tell(Wanted("a"))
    bench.run(60.0)
    for line in bench.trace:
        shares.take(line)
    [radio] = shares.utilizations(60.0, periods=False)
    assert radio.minute == pytest.approx(0.8)


def test_who_does_not_fit_even_alone_waits_and_others_run():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.tell(ask("b", {"r": load(0.4)}))
    bench.at(1.0, measured("a", 0.2))
    bench.run(10.0)
    assert bench.runs("a") == [(0.0, 1.0)]
    assert bench.runs("b") == [(0.0, None)]
    assert any("it declared 40" in line for line in bench.answers.why("a", 10.0).lines)
    assert bench.verdict() == []


def test_who_does_not_fit_even_alone_runs_once_it_is_claimed_anew_as_why_says():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.at(1.0, measured("a", 2.0))
    bench.at(2.0, CapacityChanged("r", 1.0))
    bench.run(10.0)
    why = bench.answers.why("a", 10.0)
    assert why.would_change == "its owner claims anew, with a longer period or once r is faster"
    assert any("take 2000 ms" in line for line in why.lines)
    bench.tell(Departed("a"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.run(20.0)
    assert bench.runs("a") == [(0.0, 1.0), (10.0, None)]


class Watched:
    """A schedule manager of which is worked out after each event, from outside, whether all packets are in time."""

    def __init__(self, of: ScheduleManager) -> None:
        self._of, self._longest_s = of, dict[tuple[str, str], float]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        match event:
            case Departed(arc=gone):
                self._longest_s = {key: longest_s for key, longest_s in self._longest_s.items() if key[0] != gone}
            case PacketsMeasured(rc=rc, packets=packets):
                for one in packets:
                    if not one.kind and one.arc in self._of.master_schedule.state.arcs:
                        longest_s = self._longest_s.get((one.arc, rc), 0.0)
                        self._longest_s[one.arc, rc] = max(one.packet_time_s, longest_s)
        return self._of.handle(event, now_s)

    def check(self) -> None:
        self._of.check()
        state = self._of.master_schedule.state
        connected = {lease.arc: state.arcs[lease.arc] for lease in self._of.leases()}.values()
        for rc in state.rcs.values():
            sent = [
                (arc, stream_of(self._sent(arc.name, rc.name, usage)), number)
                for arc in connected
                if rc.name in arc.shares
                for number, usage in enumerate(arc.request.alternatives[0][rc.name].streams)
            ]
            ranked = by_precedence(sent, lambda one: one[0].path, lambda one: (one[1].period, one[0].name, one[2]))
            assert not ranked or admissible([one for _, one, _ in ranked], rc.capacity), rc.name

    def _sent(self, arc: str, rc: str, usage: Usage) -> dict[str, float]:
        packet_s = max(usage.packet_time_s, self._longest_s.get((arc, rc), 0.0))
        return {"period": usage.period_s, "cost": packet_s, "deadline": usage.deadline_s, "jitter": usage.jitter_s}


def watched(bench: Bench) -> Bench:
    bench.manager = Watched(bench.manager)  # type: ignore[assignment]  # it is one in all that matters here
    return bench


def with_measurements(seed: int, *, factors: tuple[float, ...] = (1.2, 1.5, 2.0), **rules: Any) -> Bench:
    """Play a random mission in which radios measure packets that are so many times as long as declared."""
    bench, happens = random_mission(Random(seed), **rules)
    shared = [
        (event.request.arc, rc, max(usage.packet_time_s for usage in use.streams))
        for _, event in happens
        if isinstance(event, Requested)
        for rc, use in event.request.alternatives[0].items()
        if use.streams
    ]
    rng = Random(f"measured {seed}")
    for _ in range(rng.randint(1, 8) if shared else 0):
        arc, rc, declared_s = rng.choice(shared)
        takes_s = round(declared_s * rng.choice(factors), 6)
        if not _fits_alone(bench, happens, arc, rc, takes_s):
            continue  # the bound of a wait is stated for those that can run
        happens.append((rng.randint(0, int(END_S * 4)) / 4, PacketsMeasured(rc, [MeasuredPackets(arc, "", takes_s)])))
    return play(watched(bench), sorted(happens, key=lambda item: item[0]))


def _fits_alone(bench: Bench, happens: list[tuple[float, Event]], arc: str, rc: str, takes_s: float) -> bool:
    times = PacketTimes()
    times.take(rc, arc, "", takes_s)
    request = next(event.request for _, event in happens if isinstance(event, Requested) and event.request.arc == arc)
    try:
        bench.manager.choose(replace(request, alternatives=[times.counted(arc, request.alternatives[0])]))
    except CapacityExceeded:
        return False
    return True


@settings(max_examples=share(120))
@given(seeds, st.sampled_from(RULES))
def test_no_one_is_admitted_whom_the_measured_times_do_not_let_fit(seed, rules):
    """And the checker, which knows the lines of the trace alone, finds nothing."""
    assert violations(with_measurements(seed, **rules)) == []


@settings(max_examples=share(40))
@given(seeds)
def test_no_one_is_admitted_so_in_a_group_too_big_to_be_planned_whole(seed):
    with_measurements(seed, exact_up_to=0)


@settings(max_examples=share(40))
@given(seeds)
def test_the_judge_finds_no_packet_late_and_no_slice_cut(seed):
    lines = [*with_measurements(seed).trace, {"ev": "end", "t": END_S}]
    found = judge().FullChecker().run(copy.deepcopy(lines))
    assert {one.code for one in found} <= {"FAIR", "GRACE"}, "those two differ without measurements, too"


@settings(max_examples=share(60))
@given(seeds, st.sampled_from(RULES))
def test_shorter_packets_change_nothing(seed, rules):
    measuring = with_measurements(seed, factors=(0.01, 0.05, 0.1), **rules)
    bench, happens = random_mission(Random(seed), **rules)
    assert rounded(measuring.trace) == rounded(play(bench, happens).trace)


def rounded(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{**line, "t": round(line["t"], 6)} for line in lines]


HOSTILE = st.one_of(
    st.sampled_from([0.0, -0.0, -1.0, math.nan, math.inf, -math.inf, 1e300, -1e300, A_DAY_S * 2]),
    st.floats(max_value=0.0),
)


@given(HOSTILE)
def test_numbers_that_no_packet_can_take_change_nothing(packet_s):
    times = PacketTimes()
    declared = {"r": RcUse([Usage(0.1, 0.002)])}
    assert not times.take("r", "a", "", packet_s)
    assert times.counted("a", declared) == declared


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(1e-6, 1.0)), max_size=20), st.floats(1e-6, 1.0))
@example([("a", 0.5), ("a", 0.2)], 0.1)
def test_the_longest_counts_and_never_less_than_declared(told, declared_s):
    times = PacketTimes()
    for arc, packet_s in told:
        times.take("r", arc, "", packet_s)
    counted = times.counted("a", {"r": RcUse([Usage(2.0, declared_s)])})["r"].streams[0].packet_time_s
    assert counted == max([declared_s, *(packet_s for arc, packet_s in told if arc == "a")])
    times.forget("a")
    assert times.counted("a", {"r": RcUse([Usage(2.0, declared_s)])})["r"].streams[0].packet_time_s == declared_s


def test_a_change_of_capacity_or_order_counts_the_measured_times():
    for change in (CapacityChanged("r", 0.8), PriorityChanged("owner-b", 5)):
        bench = watched(Bench(manager(), sharable("r")))
        bench.tell(ask("a", {"r": load(0.4)}))
        bench.tell(ask("b", {"r": load(0.3)}))
        bench.tell(measured("a", 0.06))
        bench.run(1.0)
        bench.tell(change)
        bench.run(10.0)
        assert bench.verdict() == []
    assert any(isinstance(one, ConnectArc) for _, one in bench.instructions)
