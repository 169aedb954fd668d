"""Which RCs a request gets, and which requests are refused."""

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, unit

from backbone.scheduling.events import (
    CapacityChanged,
    RcWentDown,
)
from backbone.scheduling.requests import (
    CapacityExceeded,
    MissingRuntime,
    PathNode,
    RcUse,
    SchedulingRefusal,
    SchedulingRequest,
    UnknownRc,
    Usage,
)

# Which RCs.


def wish(arc: str, *alternatives: str, run_s: float = 5.0) -> SchedulingRequest:
    sets = [{rc: RcUse() for rc in one.split()} for one in alternatives]
    return SchedulingRequest(arc, f"mission_control/{arc}", [PathNode(arc, 1)], False, sets, run_s)


def test_two_claims_of_any_robot_get_two_robots():
    bench = Bench(manager(), unit("s1"), unit("s2"), unit("v"))
    bench.tell(ask("first", "s1 v"))
    assert bench.manager.choose(wish("second", "s1 v", "s2 v")) == ("s2", "v")
    assert bench.manager.choose(wish("first", "s2 v", "s1 v")) == ("s1", "v")


def test_a_robot_that_failed_is_chosen_last_and_a_running_one_before_one_not_started():
    bench = Bench(manager(), unit("s1"), unit("s2", up=False), unit("s3"))
    bench.tell(RcWentDown("s1"))
    assert bench.manager.choose(wish("a", "s1", "s2", "s3")) == ("s3",)
    assert bench.manager.choose(wish("a", "s1", "s2")) == ("s2",)
    assert bench.manager.choose(wish("a", "s1")) == ("s1",)


def test_an_unknown_rc_is_refused_unless_another_alternative_would_do():
    bench = Bench(manager(), unit("s1"))
    assert bench.manager.choose(wish("a", "s9", "s1")) == ("s1",)
    with pytest.raises(UnknownRc) as refused:
        bench.manager.choose(wish("a", "s9"))
    assert refused.value.facts["rc"] == "s9"


def test_a_demand_that_can_never_be_served_is_refused_with_the_numbers():
    bench = Bench(manager(), sharable("r", 0.5))
    bench.tell(ask("a", {"r": load(0.2)}))
    with pytest.raises(CapacityExceeded) as refused:
        bench.manager.choose(ask("b", {"r": load(0.6)}).request)
    assert refused.value.facts == {"rc": "r", "demanded": 0.6, "used": 0.2, "free": 0.3}


@pytest.mark.parametrize(
    ("least_s", "most_s"),
    [
        (0.0, 0.0),
        (-1.0, 0.0),
        (5.0, 4.0),
        (1e-12, 0.0),
        (1e308, 0.0),
        (5.0, 1e308),
        (float("nan"), 0.0),
        (5.0, float("nan")),
    ],
)
def test_a_request_without_a_usable_minimum_run_time_is_refused(least_s, most_s):
    bench = Bench(manager(), unit("v"))
    with pytest.raises(MissingRuntime):
        bench.manager.choose(ask("a", "v", run_s=least_s, most_s=most_s).request)


@pytest.mark.parametrize("usage", [Usage(0.0, 0.1), Usage(0.1, 0.0), Usage(0.1, 0.01, -1.0), Usage(float("inf"), 0.1)])
def test_a_stream_that_makes_no_sense_is_refused(usage):
    bench = Bench(manager(), sharable("r"))
    with pytest.raises(SchedulingRefusal):
        bench.manager.choose(ask("a", {"r": RcUse([usage])}).request)


def test_more_streams_than_a_message_may_have_are_refused():
    bench = Bench(manager(), sharable("r"))
    with pytest.raises(SchedulingRefusal, match="995 streams"):
        bench.manager.choose(ask("a", {"r": RcUse([Usage(100.0, 1e-5)] * 995)}).request)


def test_streams_on_an_rc_that_is_not_sharable_are_held_to_what_it_can_serve_and_use_it_alone():
    bench = Bench(manager(), unit("u"))
    with pytest.raises(CapacityExceeded):
        bench.manager.choose(ask("a", {"u": load(1.2)}).request)
    for arc in "ab":
        bench.tell(ask(arc, {"u": load(0.2)}))
    assert [line["use"] for line in bench.trace if line["ev"] == "request"] == [{"u": "x"}] * 2
    assert [bench.run(1.0).runs(arc) for arc in "ab"] == [[(0.0, None)], []]


@pytest.mark.parametrize("capacity", [float("nan"), -0.1, 1.1, float("inf")])
def test_a_capacity_that_cannot_be_changes_nothing(capacity):
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("a", {"r": load(0.4)}))
    bench.tell(CapacityChanged("r", capacity))
    assert bench.run(1.0).runs("a") == [(0.0, None)]
    assert bench.answers.schedule(1.0).rcs[0].capacity == 1.0


@pytest.mark.parametrize("capacity", [0.0, 0.5])
def test_a_unit_rc_has_no_capacity_that_could_change(capacity):
    bench = Bench(manager(), unit("v"))
    for arc in "abc":
        bench.tell(ask(arc, "v"))
    bench.at(1.0, CapacityChanged("v", capacity))
    bench.run(2.0)
    assert [bench.runs(arc) for arc in "abc"] == [[(0.0, None)], [], []]
    assert bench.verdict() == []


def test_a_request_for_nothing_is_refused():
    with pytest.raises(SchedulingRefusal):
        manager().choose(wish("a"))
