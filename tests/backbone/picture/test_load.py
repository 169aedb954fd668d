"""Loads: all processor time of processes is somebody's, robots have theirs in parts, and a restart is no debt."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import PROCESSOR_S, ComponentState, LifeState
from backbone.picture.load import LoadReading, ModuleLoad, loads
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule


def component(address: str, pid: int, host: str = "base") -> ComponentState:
    return ComponentState(address, "kind", host, pid, LifeState.READY, 0.0)


def robot(name: str) -> RcView:
    return RcView(name, "scout", "up", sharable=False, capacity=1.0, holders=[], last_epoch=0, next=[], is_robot=True)


def request(arc: str, *rcs: str) -> RequestView:
    return RequestView(arc, "owner", RequestState.RUNNING, list(rcs), 0.0, 0.0, 0.0, "", [], 1.0, "", 0)


def reading(at_s: float, **processor_s: float) -> LoadReading:
    return LoadReading(at_s, {f"resource_pool/{name}": {PROCESSOR_S: value} for name, value in processor_s.items()})


PLACES = st.lists(st.tuples(st.integers(1, 4), st.floats(0, 100), st.floats(0, 100)), min_size=1, max_size=8)


@given(PLACES)
def test_the_time_of_a_process_is_counted_once(places: list[tuple[int, float, float]]) -> None:
    """Components of one process say the same time, because it is the process's."""
    first_of, more_of = {p: a for p, a, _ in places}, {p: b for p, _, b in places}
    present = [component(f"resource_pool/c{number}", pid) for number, (pid, _, _) in enumerate(places)]
    first = reading(0.0, **{f"c{n}": first_of[p] for n, (p, _, _) in enumerate(places)})
    then = reading(2.0, **{f"c{n}": first_of[p] + more_of[p] for n, (p, _, _) in enumerate(places)})
    found = loads(present, None, first, then)
    assert sum(one.cores for one in found.processes) == pytest.approx(sum(more_of.values()) / 2.0, abs=1e-6)
    assert sorted(name for one in found.processes for name in one.components) == [f"c{n}" for n in range(len(places))]
    assert found.silent == []


def test_a_robot_has_its_rc_and_its_arcs_in_parts() -> None:
    present = [component(f"resource_pool/{name}", pid) for name, pid in (("s1", 1), ("s2", 1), ("pair", 2), ("one", 3))]
    schedule = Schedule(0.0, [robot("s1"), robot("s2")], [request("pair", "s1", "s2"), request("one", "s1")], [])
    first = reading(0.0, s1=0.0, s2=0.0, pair=0.0, one=0.0)
    then = reading(1.0, s1=0.4, s2=0.4, pair=0.2, one=0.1)
    [s1, s2] = loads(present, schedule, first, then).robots
    assert (s1.components, s1.cores) == (("s1", "pair", "one"), pytest.approx(0.2 + 0.1 + 0.1))
    assert (s2.components, s2.cores) == (("s2", "pair"), pytest.approx(0.2 + 0.1))


def test_a_process_that_was_restarted_counts_from_its_begin() -> None:
    [process] = loads([component("resource_pool/s1", 7)], None, reading(0.0, s1=50.0), reading(1.0, s1=0.3)).processes
    assert process.cores == pytest.approx(0.3)


def test_who_says_nothing_is_named() -> None:
    present = [component("resource_pool/s1", 1), component("resource_pool/s2", 2)]
    found = loads(present, None, reading(0.0, s1=0.0), reading(1.0, s1=0.5))
    assert found.silent == ["s2"]
    assert [one.components for one in found.processes] == [("s1",)]


def test_a_module_has_the_time_of_its_updates() -> None:
    at = "mission_control/vision"
    before = {"ball_runs": 10.0, "ball_busy_s": 1.0, "ball_longest_s": 0.2, "other_busy_s": 5.0}
    after = {"ball_runs": 30.0, "ball_busy_s": 2.0, "ball_longest_s": 0.3, "other_busy_s": 6.0}
    [module] = loads([], None, LoadReading(0.0, {at: before}), LoadReading(2.0, {at: after})).modules
    assert module == ModuleLoad("vision", "ball", 2.0, 0.5, 10.0, 0.3)
    [anew] = loads([], None, LoadReading(0.0, {at: after}), LoadReading(2.0, {at: before})).modules
    assert (anew.cores, anew.rate_hz) == (0.5, 5.0)
