"""Whatever is heard, and in whatever order, no counter falls, and no RC is held for longer than was watched."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.metrics.tally import BUCKETS_S, GONE_KEPT, Tally
from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule

RCS, ARCS = ["radio", "scout1"], ["anna-drive", "watch-capture"]
SHARABLE = "radio"
Heard = Callable[[Tally], None]


def rc_view(rc: str, arcs: list[str], epoch: int = 1) -> RcView:
    held = [Holder(arc, epoch, 0.0, 0.0) for arc in arcs]
    return RcView(rc, "kind", "up", rc == SHARABLE, 1.0, held, epoch, [])


def request(arc: str, state: RequestState) -> RequestView:
    return RequestView(arc, f"ui_console/{arc}", state, RCS, 0.0, -1.0, -1.0, "", [], 1.0, "", 0)


def schedule(at_s: float, holders: dict[str, list[str]], waiting: list[str] = []) -> Schedule:  # noqa: B006  not changed
    states = {arc: RequestState.WAITING if arc in waiting else RequestState.RUNNING for arc in ARCS}
    views = [request(arc, state) for arc, state in states.items()]
    return Schedule(at_s, [rc_view(rc, holders.get(rc, [])) for rc in RCS], views, [])


times = st.floats(0, 100)
arcs = st.sampled_from(ARCS)
holders = st.fixed_dictionaries({"radio": st.lists(arcs, unique=True), "scout1": st.lists(arcs, max_size=1)})
lines = st.one_of(
    st.builds(lambda t, arc, by: {"ev": "revoke", "t": t, "arc": arc, "why": "slice", "by": by}, times, arcs, arcs),
    st.builds(
        lambda t, arc, epoch: {"ev": "grant", "t": t, "arc": arc, "epoch": dict.fromkeys(RCS, epoch)},
        times,
        arcs,
        st.integers(0, 5),
    ),
)
heard = st.one_of(
    st.builds(lambda *of: lambda tally: tally.take_schedule(schedule(*of)), times, holders, st.lists(arcs)),
    st.builds(lambda at_s, lasts_s: lambda tally: tally.take_leases(Leases([], lasts_s), at_s), times, st.floats(0, 9)),
    st.builds(lambda line: lambda tally: tally.take_line(line), lines),
    st.builds(lambda at_s: lambda tally: tally.advance(at_s), times),
)


def numbers(tally: Tally) -> dict[Any, float]:
    counters = (tally.held_s, tally.waited_s, tally.in_state_s, tally.grants, tally.revocations)
    found: dict[Any, float] = {(number, key): value for number, of in enumerate(counters) for key, value in of.items()}
    for rc, histogram in tally.switches.items():
        found |= {(rc, number): count for number, count in enumerate(histogram.counts)} | {(rc, "sum"): histogram.sum_s}
    return found | {"watched": tally.watched_s}


@given(st.lists(heard, max_size=30))
def test_no_counter_falls_and_no_rc_is_held_for_longer_than_was_watched(events: list[Heard]) -> None:
    tally = Tally()
    for event in events:
        before = numbers(tally)
        event(tally)
        after = numbers(tally)
        assert all(after[name] >= value for name, value in before.items())
        assert sum(tally.held_s["scout1", arc] for arc in ARCS) <= tally.watched_s * (1 + 1e-9)
        for arc in ARCS:
            in_states_s = sum(value for (of, _state), value in tally.in_state_s.items() if of == arc)
            assert in_states_s <= tally.watched_s * (1 + 1e-9)


@given(st.lists(st.tuples(st.floats(0.01, 5.0), holders), min_size=1, max_size=10))
def test_each_holder_has_exactly_the_time_between_the_schedules_that_name_it(steps: list[Any]) -> None:
    tally, at_s = Tally(), 0.0
    expected: dict[tuple[str, str], float] = {}
    tally.take_schedule(schedule(0.0, {}))
    tally.take_leases(Leases([], 1000.0), 0.0)
    for lasts_s, held in steps:
        tally.take_schedule(schedule(at_s, held))
        at_s += lasts_s
        for rc, by in held.items():
            for arc in by:
                expected[rc, arc] = expected.get((rc, arc), 0.0) + lasts_s
    tally.advance(at_s)
    assert tally.watched_s == pytest.approx(at_s)
    assert dict(tally.held_s) == pytest.approx(expected)


def test_who_waits_waits_for_each_rc_of_its_set() -> None:
    tally = Tally()
    tally.take_schedule(schedule(10.0, {"scout1": ["anna-drive"]}, ["watch-capture"]))
    tally.take_leases(Leases([], 100.0), 10.0)
    tally.advance(14.0)
    assert dict(tally.waited_s) == {("radio", "watch-capture"): 4.0, ("scout1", "watch-capture"): 4.0}
    assert tally.in_state_s["anna-drive", "running"] == tally.in_state_s["watch-capture", "waiting"] == 4.0


def test_a_hold_counts_until_its_lease_is_over_if_the_rc_manager_is_silent() -> None:
    tally = Tally()
    tally.take_schedule(schedule(0.0, {"scout1": ["anna-drive"]}))
    tally.take_leases(Leases([], 2.0), 0.0)
    tally.advance(9.0)
    tally.take_leases(Leases([], 2.0), 10.0)
    tally.advance(11.0)
    assert (tally.held_s["scout1", "anna-drive"], tally.watched_s) == (3.0, 11.0)


def test_a_hand_over_is_timed_and_one_that_is_told_again_is_not_counted_again() -> None:
    tally = Tally()
    tally.take_schedule(schedule(0.0, {"scout1": ["anna-drive"], "radio": ["anna-drive"]}))
    tally.take_line({"ev": "revoke", "t": 5.0, "arc": "anna-drive", "why": "higher", "by": "watch-capture"})
    granted = {"ev": "grant", "t": 5.3, "arc": "watch-capture", "epoch": {"scout1": 7, "radio": 7}}
    for line in (granted, granted):
        tally.take_line(line)
    assert tally.grants == {("scout1", "watch-capture"): 1, ("radio", "watch-capture"): 1}
    assert tally.revocations == {("scout1", "anna-drive", "higher"): 1, ("radio", "anna-drive", "higher"): 1}
    [(rc, histogram)] = tally.switches.items()
    assert (rc, histogram.sum_s) == ("scout1", pytest.approx(0.3)), "the radio is shared: nobody hands it over"
    assert histogram.counts[BUCKETS_S.index(0.5)] == sum(histogram.counts) == 1


@pytest.mark.parametrize("why", [{"why": "self"}, {"why": "rc", "by": "radio"}, {"why": "higher", "by": "ben-drive"}])
def test_an_rc_that_was_not_revoked_for_its_next_holder_was_not_handed_over(why: dict[str, str]) -> None:
    tally = Tally()
    tally.take_schedule(schedule(0.0, {"scout1": ["anna-drive"]}))
    tally.take_line({"ev": "revoke", "t": 5.0, "arc": "anna-drive", **why})
    tally.take_line({"ev": "grant", "t": 900.0, "arc": "watch-capture", "epoch": {"scout1": 7}})
    assert sum(tally.switches["scout1"].counts) == 0


def test_of_the_arcs_that_left_only_the_last_ones_have_numbers():
    tally, visits = Tally(), 5 * GONE_KEPT
    for visit in range(visits):
        arc, at_s = f"console-{visit}-drive", 10.0 * visit
        held = [rc_view(rc, [arc, "watch"] if rc == SHARABLE else [arc], visit) for rc in RCS]
        requests = [request("watch", RequestState.RUNNING), request(arc, RequestState.WAITING)]
        tally.take_line({"ev": "grant", "t": at_s, "arc": arc, "epoch": dict.fromkeys(RCS, visit)})
        tally.take_schedule(Schedule(at_s, held, requests, []))
        tally.take_leases(Leases([], 20.0), at_s)
        tally.take_line({"ev": "revoke", "t": at_s + 9.0, "arc": arc, "why": "self"})
    tally.take_schedule(Schedule(10.0 * visits, [rc_view(rc, []) for rc in RCS], [requests[0]], []))
    arcs = [{key[1] for key in of} for of in (tally.held_s, tally.waited_s, tally.grants, tally.revocations)]
    last = {f"console-{visit}-drive" for visit in range(visits - GONE_KEPT, visits)}
    assert arcs == [last | {"watch"}, last, last, last]
    assert {key[0] for key in tally.in_state_s} == last | {"watch"}
    assert tally.held_s[SHARABLE, "watch"] == pytest.approx(10.0 * visits)
