"""What the schedule manager says about a schedule, and the rules that a mission can choose."""

from random import Random

import pytest
from simulated_switches import Bench, ask, load, manager, sharable, states, unit

from backbone.scheduling.events import (
    Departed,
    PriorityChanged,
)
from backbone.scheduling.requests import (
    RcUse,
    RequestState,
    UnknownRequest,
    Usage,
)
from backbone.scheduling.rules import SchedulingRules

# What it says.


def test_the_answer_to_a_request_says_when_and_behind_whom():
    bench = Bench(manager(), unit("v", connect_s=0.5))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.tell(ask("c", "v"))
    bench.run(1.0)
    a, b, c = (bench.answers.scheduled(arc, 1.0) for arc in "abc")
    assert (a.state, a.position, a.blockers) == (RequestState.RUNNING, 0, [])
    assert (b.state, b.position, b.blockers, b.expected_start_s) == (RequestState.WAITING, 1, ["a"], 6.0)
    assert (c.position, c.blockers, c.expected_start_s) == (2, ["a", "b"], 11.5)


def test_predicted_starts_come_true():
    bench = Bench(manager(), unit("v", connect_s=0.5))
    for name in "abcd":
        bench.tell(ask(name, "v"))
    bench.run(1.0)
    expected = {name: bench.answers.scheduled(name, 1.0).expected_start_s for name in "bcd"}
    bench.run(30.0)
    assert expected == {name: bench.runs(name)[0][0] for name in "bcd"}


def test_why_names_the_blocker_its_rank_and_the_end_of_its_slice():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.run(2.0)
    why = bench.answers.why("b", 2.0)
    assert (why.state, why.rule, why.blockers, why.expected_start_s) == ("waiting", "3", ["a"], 5.0)
    assert "a (equal, shares v) runs, its slice ends at 5.00 s" in why.lines
    assert "a" in why.would_change


def test_why_names_the_higher_one_for_which_strict_holds_a_free_rc():
    """Its RCs are free beside the one that runs; ``why`` named that one, and spoke of a gap that is too short."""
    radio = {"radio": load(0.1)}
    bench = Bench(manager(policy="strict"), unit("s1"), unit("s2"), sharable("radio"))
    bench.tell(ask("top", {"s1": RcUse(), **radio}, priority=3))
    bench.tell(ask("middle", {"s1": RcUse(), **radio}, priority=2))
    for low in ("low", "later"):
        bench.tell(ask(low, {"s2": RcUse(), **radio}, priority=1))
    bench.run(20.0)
    assert states(bench) == {"top": "running", "middle": "waiting", "low": "waiting", "later": "waiting"}
    for name in ("low", "later"):
        why = bench.answers.why(name, 20.0)
        assert "none starts while middle, higher in its group, waits (policy strict)" in why.lines[0]
        assert why.lines[1].startswith("middle (higher, shares radio) waits")
        assert why.rule == "8"
    bench.tell(Departed("middle"))
    bench.run(21.0)
    assert states(bench)["low"] == "running"


def test_why_knows_owners_by_name_and_address_and_rcs():
    bench = Bench(manager(), unit("v"), unit("w"))
    bench.tell(ask("a", "v"))
    bench.run(1.0)
    assert bench.answers.why("owner-a", 1.0).state == "running"
    assert bench.answers.why("mission_control/owner-a", 1.0).lines[0].startswith("a running")
    assert bench.answers.why("v", 1.0).blockers == ["a"]
    assert bench.answers.why("w", 1.0).lines == ["w is up", "no ARC asks for it"]
    with pytest.raises(UnknownRequest):
        bench.answers.why("nobody", 1.0)
    with pytest.raises(UnknownRequest):
        bench.answers.scheduled("nobody", 1.0)


def test_why_of_an_owner_is_about_its_arc_that_waits_longest():
    """It was about the first by name."""
    bench = Bench(manager(), unit("v"), unit("w"))
    for rc in "vw":
        bench.tell(ask(f"holder-{rc}", rc, priority=2))
    bench.tell(ask("z", "v", path=[("watch", 0), ("tour", 1)]))
    bench.run(1.0)
    bench.tell(ask("a", "w", path=[("watch", 0), ("tour", 1)]))
    assert bench.answers.why("tour", 2.0).blockers == ["holder-v"]


def test_why_has_an_answer_in_every_state():
    bench = Bench(manager(), unit("v", connect_s=1.0, disconnect_s=1.0), unit("down", up=False))
    bench.fails["f"] = ""
    bench.tell(ask("a", "v"))
    bench.tell(ask("i", "v", idle=True))
    bench.tell(ask("n", "down"))
    rules = {name: bench.answers.why(name, 0.0).rule for name in ("a", "i", "n")}
    assert rules == {"a": "6", "i": "14", "n": "11"}
    bench.run(7.0)
    assert bench.answers.why("a", 7.0).rule == "5"
    bench.tell(ask("f", "v"))
    assert bench.answers.why("a", 7.0).state == "revoking"
    bench.run(9.0)
    assert "again at" in bench.answers.why("f", 9.0).lines[0]


def test_an_rc_that_settles_late_is_overdue():
    """It was said to have settled at the planned time."""
    bench = Bench(manager(), unit("v", connect_s=1.0), delay_s=lambda: 3.0)
    bench.tell(ask("a", "v"))
    assert "settled at 1.00 s" in bench.answers.why("a", 0.5).lines[0]
    assert "overdue since 1.00 s" in bench.answers.why("a", 2.0).lines[0]


def test_the_schedule_shows_holders_and_who_is_next():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.run(2.0)
    view = bench.answers.schedule(2.0)
    assert [(holder.arc, holder.epoch) for holder in view.rcs[0].holders] == [("a", 1)]
    assert view.rcs[0].next == ["b"]
    assert view.groups == [["a", "b"]]
    a, b = view.requests
    assert (a.until_s, a.turns, a.priority) == (5.0, 1, "watch:0/owner-a:1")
    assert (b.state, b.expected_start_s, b.blockers) == ("waiting", 5.0, ["a"])


@pytest.mark.parametrize(("policy", "discipline"), [("greedy", "turns"), ("no_delay", "luck")])
def test_an_unknown_policy_or_discipline_is_refused(policy, discipline):
    with pytest.raises(ValueError, match="unknown"):
        SchedulingRules(policy=policy, discipline=discipline)


# Rules to choose.


def granted_s(bench: Bench, arc: str) -> list[float]:
    return [start_s for start_s, _ in bench.runs(arc)]


def test_under_the_discipline_time_equals_get_equal_time_whatever_they_ask_for():
    """What short slices the one is given in a row cost no switch."""
    bench = Bench(manager(discipline="time"), unit("v"))
    bench.tell(ask("long", "v", run_s=6.0))
    bench.tell(ask("short", "v", run_s=2.0))
    bench.run(120.0)
    runs = {arc: [end_s - start_s for start_s, end_s in bench.runs(arc) if end_s] for arc in ("long", "short")}
    assert sum(runs["short"]) == pytest.approx(sum(runs["long"]), abs=8.0)
    assert set(runs["long"]) == {6.0}
    assert all(run_s % 2.0 == 0 for run_s in runs["short"])


@pytest.mark.parametrize("jitter_s", [0.0, 0.01])
def test_under_the_discipline_time_equals_that_ask_for_the_same_take_turns(jitter_s):
    """Also where no two slices are equally long to the millisecond (rule 13: with equal run times, round robin)."""
    dice = Random(1)
    bench = Bench(manager(discipline="time", tolerance_s=0.05), unit("v"), delay_s=lambda: dice.uniform(0.0, jitter_s))
    bench.tell(ask("left", "v", run_s=2.5))
    bench.tell(ask("right", "v", run_s=2.5))
    bench.run(120.0)
    for arc in ("left", "right"):
        assert max(end_s - start_s for start_s, end_s in bench.runs(arc) if end_s) < 2.6


def test_an_equal_that_runs_on_under_the_discipline_time_is_named():
    """Its resource was said to be coming free."""
    bench = Bench(manager(discipline="time"), unit("v"))
    bench.tell(ask("long", "v", run_s=8.0))
    bench.tell(ask("short", "v", run_s=1.0))
    bench.run(10.5)
    assert bench.runs("short") == [(8.0, None)]
    for because in (bench.answers.why("long", 10.5).lines[0], bench.answers.schedule(10.5).requests[0].because):
        assert "for short, granted at about" in because


def test_slices_end_on_the_grid():
    bench = Bench(manager(grid_s=4.0), unit("v"), unit("w"))
    bench.at(0.5, ask("a", "v", run_s=3.0))
    bench.at(1.0, ask("b", "v", run_s=3.0))
    bench.at(1.5, ask("c", "w", run_s=5.0))
    bench.at(2.0, ask("d", "w", run_s=5.0))
    bench.run(30.0)
    ends = [end_s for arc in "abcd" for _, end_s in bench.runs(arc) if end_s is not None]
    assert ends
    assert all(end_s % 4.0 == 0 for end_s in ends)
    assert bench.verdict() == []


def test_the_sum_test_admits_what_adds_up_though_not_every_packet_is_in_time():
    tight = {"r": RcUse([Usage(0.01, 0.002, 0.0025)])}
    slow = {"r": RcUse([Usage(0.1, 0.05)])}
    for admission, both in (("exact", False), ("sum", True)):
        bench = Bench(manager(admission=admission), sharable("r"))
        bench.tell(ask("tight", tight, priority=2))
        bench.tell(ask("slow", slow))
        bench.run(1.0)
        assert bool(bench.runs("slow")) == both, admission


def test_the_trace_says_when_a_group_is_too_big_to_be_planned_whole():
    bench = Bench(manager(exact_up_to=2), unit("v"))
    for name in "abc":
        bench.tell(ask(name, "v"))
    assert [line["wc"] for line in bench.trace if line["ev"] == "meta"] == ["plan", "relaxed"]


@pytest.mark.parametrize("rules", [{"policy": "x"}, {"discipline": "x"}, {"admission": "x"}, {"aging_s": -1.0}])
def test_rules_nobody_knows_are_refused(rules):
    with pytest.raises(ValueError, match=r"unknown|at least 0"):
        manager(**rules)


def test_a_changed_order_that_a_radio_cannot_serve_revokes_the_last():
    """Alone in its order each is in time; with the long packets first the tight ones would be late."""
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("tight", {"r": RcUse([Usage(0.1, 0.01, 0.06)])}, priority=2))
    bench.tell(ask("long", {"r": RcUse([Usage(0.1, 0.03), Usage(0.2, 0.03)])}, priority=1))
    bench.run(1.0)
    assert states(bench) == {"tight": RequestState.RUNNING, "long": RequestState.RUNNING}
    bench.tell(PriorityChanged("owner-long", 3))
    assert RequestState.RUNNING in states(bench).values()
    assert bench.verdict() == []
