from __future__ import annotations

from random import Random

import pytest
from simulated_switches import REPAIR_S, Bench, ask, load, manager, sharable, unit

from backbone.scheduling.arc_events import RETRY_S
from backbone.scheduling.events import (
    Adopted,
    CapacityChanged,
    ConnectArc,
    Departed,
    Extended,
    Freed,
    Idled,
    Opened,
    OpenFailed,
    PriorityChanged,
    RcCameBack,
    RcWentDown,
    RenewLeases,
    RevokeArc,
    RuntimeChanged,
    WakeAt,
    Wanted,
    Woken,
)
from backbone.scheduling.requests import (
    CapacityExceeded,
    MissingRuntime,
    PathNode,
    RcUse,
    RequestState,
    SchedulingRefusal,
    SchedulingRequest,
    UnknownRc,
    UnknownRequest,
    Usage,
)
from backbone.scheduling.rules import SchedulingRules


def all_of(bench: Bench, kind: type) -> list:
    return [instruction for _, instruction in bench.instructions if isinstance(instruction, kind)]


def states(bench: Bench) -> dict[str, RequestState]:
    return {view.arc: view.state for view in bench.answers.schedule(bench.now_s).requests}


# Context switches.


def test_a_grant_counts_its_minimum_run_time_from_the_open_gate():
    bench = Bench(manager(), unit("v", connect_s=0.3), delay_s=lambda: 0.1)
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.run(6.0)
    assert bench.runs("a") == [(0.4, 5.4)]
    assert all_of(bench, ConnectArc)[0].until_s == 5.3


def test_the_slice_of_an_owner_with_nothing_to_bring_to_rest_ends_at_once():
    bench = Bench(manager(grace_s=0.2), unit("v"))
    bench.tell(ask("a", "v", stops_at_once=True))
    bench.tell(ask("b", "v"))
    bench.run(6.0)
    assert [(order.arc, order.why, order.deadline_s) for order in all_of(bench, RevokeArc)] == [("a", "slice", 0.0)]


def test_a_slice_ends_politely_and_an_override_does_not_wait():
    bench = Bench(manager(grace_s=0.2), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.run(6.0)
    bench.tell(ask("human", "v", priority=9, console=True))
    polite, forced = all_of(bench, RevokeArc)
    assert (polite.arc, polite.why, polite.by, polite.deadline_s) == ("a", "slice", "b", 0.2)
    assert (forced.arc, forced.why, forced.by, forced.deadline_s) == ("b", "higher", "human", 0.0)
    assert polite.expected_s == pytest.approx(10.0, abs=0.01)
    assert forced.expected_s < 0


def test_epochs_grow_from_the_largest_the_rc_has_seen():
    bench = Bench(manager(), unit("v"))
    bench.tell(RcWentDown("v"))
    bench.tell(RcCameBack("v", 41))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.run(11.0)
    assert [order.epochs["v"] for order in all_of(bench, ConnectArc)] == [42, 43, 44]


def test_epochs_in_grants_grow_although_a_later_one_settles_sooner():
    bench = Bench(manager(), sharable("r"), unit("slow", connect_s=1.0))
    bench.tell(ask("a", {"r": load(0.3), "slow": RcUse()}))
    bench.at(0.5, ask("b", {"r": load(0.3)}))
    bench.run(2.0)
    assert bench.runs("b")[0][0] < bench.runs("a")[0][0]
    assert bench.verdict() == []


def test_rank_on_a_sharable_rc_counts_the_higher_holders():
    bench = Bench(manager(), sharable("r"))
    bench.tell(ask("low", {"r": load(0.1)}, priority=1))
    bench.tell(ask("high", {"r": load(0.1)}, priority=3))
    bench.tell(ask("middle", {"r": load(0.1)}, priority=2))
    assert [order.ranks["r"] for order in all_of(bench, ConnectArc)] == [0, 0, 1]
    assert len(all_of(bench, RenewLeases)) == 2  # of those whose ranks another's connection may have changed


def test_who_stays_for_a_new_slice_comes_behind_who_left_for_another():
    bench = Bench(manager(), sharable("r"))
    for arc in ("leaves", "stays", "comes"):
        bench.tell(ask(arc, {"r": load(0.4)}))
    bench.at(6.0, ask("high", {"r": RcUse()}, priority=9))
    bench.at(8.0, Departed("high", "self"))
    bench.run(9.0)
    assert [line["arc"] for line in bench.trace if line["ev"] == "slice"] == ["stays"]
    assert [line["arc"] for line in bench.trace if line["ev"] == "connect"][-2:] == ["comes", "leaves"]
    assert bench.verdict() == []


def test_a_lone_arc_runs_on_and_hears_nothing():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.run(100.0)
    assert all_of(bench, RevokeArc) == []
    assert bench.runs("a") == [(0, None)]


def test_it_asks_to_be_woken_for_a_slice_end_only_if_somebody_waits():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.run(0.0)
    assert all_of(bench, WakeAt) == []
    bench.tell(ask("b", "v"))
    assert all_of(bench, WakeAt)[-1] == WakeAt(5.0)
    bench.tell(Departed("b"))
    assert all_of(bench, WakeAt)[-1] == WakeAt(None)


def test_leases_are_renewed_for_who_connects_or_runs_only():
    bench = Bench(manager(), unit("v", connect_s=0.3, disconnect_s=0.3))
    bench.tell(ask("a", "v"))
    assert [(lease.rc, lease.arc, lease.epoch) for lease in bench.manager.leases()] == [("v", "a", 1)]
    bench.run(1.0)
    assert len(bench.manager.leases()) == 1
    bench.tell(Departed("a"))
    assert bench.manager.leases() == []


# What ARCs want.


def test_idle_frees_the_rcs_and_want_is_a_new_arrival():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.at(1.0, Idled("a"))
    bench.at(2.0, Wanted("a"))
    bench.run(10.0)
    assert bench.runs("a") == [(0, 1), (6, None)]
    assert bench.runs("b") == [(1, 6)]
    assert bench.verdict() == []


def test_want_during_the_hand_over_of_idle_counts():
    bench = Bench(manager(), unit("v", disconnect_s=1.0))
    bench.tell(ask("a", "v"))
    bench.at(1.0, Idled("a"))
    bench.at(1.5, Wanted("a"))
    bench.run(3.0)
    assert bench.runs("a") == [(0, 1), (2, None)]
    assert bench.verdict() == []


def test_an_extension_ends_at_the_maximum_run_time():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v", most_s=7.0))
    bench.tell(ask("b", "v"))
    bench.at(4.0, Extended("a", 6.0))
    bench.at(5.5, Extended("a", 60.0))
    bench.run(8.0)
    assert bench.runs("a") == [(0, 7)]
    assert bench.verdict() == []


def test_other_run_times_hold_from_the_next_slice_on():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    bench.at(1.0, RuntimeChanged("a", 6.0, 6.0))
    bench.run(17.0)
    assert bench.runs("a") == [(0, 5), (10, 16)]


@pytest.mark.parametrize("run_s", [0.0, -1.0, float("nan"), float("inf")])
def test_run_times_that_make_no_sense_change_nothing(run_s):
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    lines = len(bench.trace)
    bench.tell(RuntimeChanged("a", run_s, run_s))
    assert len(bench.trace) == lines


def test_asking_again_for_the_same_changes_nothing():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    before = len(bench.trace)
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    assert len(bench.trace) == before


def test_asking_again_for_other_rcs_frees_the_old_ones_first():
    bench = Bench(manager(), unit("v", disconnect_s=0.5), unit("w"))
    bench.tell(ask("a", "v"))
    bench.at(1.0, ask("a", "w"))
    bench.run(2.0)
    assert bench.runs("a") == [(0, 1), (1.5, None)]
    assert [lease.rc for lease in bench.manager.leases()] == ["w"]
    assert bench.verdict() == []


def test_an_owner_that_dies_while_it_asks_anew_leaves_nothing_behind():
    bench = Bench(manager(), unit("v", disconnect_s=0.5), unit("w"))
    bench.tell(ask("a", "v"))
    bench.at(1.0, ask("a", "w"))
    bench.at(1.2, Departed("a", "dead"))
    bench.run(3.0)
    assert states(bench) == {}


def test_events_about_nobody_change_nothing():
    bench = Bench(manager(), unit("v"))
    lines = len(bench.trace)
    for event in (
        Wanted("x"),
        Idled("x"),
        Departed("x"),
        RuntimeChanged("x", 1.0, 1.0),
        Extended("x", 1.0),
        PriorityChanged("x", 1),
        Opened("x"),
        OpenFailed("x", ""),
        Freed("x"),
        RcWentDown("x"),
        RcCameBack("x", 1),
        CapacityChanged("x", 1.0),
        Woken(),
    ):
        bench.tell(event)
    assert len(bench.trace) == lines


# Faults.


def test_an_rc_that_fails_stops_its_holders_and_nobody_else():
    bench = Bench(manager(), unit("v"), unit("w"))
    bench.tell(ask("a", "v w"))
    bench.tell(ask("b", "w"))
    bench.at(1.0, RcWentDown("v"))
    bench.at(9.0, RcCameBack("v", 0))
    bench.run(8.0)
    assert bench.runs("b") == [(1, None)]
    assert bench.answers.why("a", 8.0).rule == "11"
    bench.run(12.0)
    assert bench.runs("a") == [(0, 1), (9, None)]
    assert bench.verdict() == []


def test_an_rc_that_was_away_for_a_moment_has_lost_its_holders():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.run(1.0)
    bench.tell(RcCameBack("v", 7))
    bench.run(2.0)
    assert bench.runs("a") == [(0, 1), (1, None)]
    assert all_of(bench, ConnectArc)[-1].epochs == {"v": 8}


def test_after_a_failed_connection_others_go_on_and_the_arc_waits_for_the_rc():
    bench = Bench(manager(), unit("v"), unit("w"))
    bench.fails["a"] = "v"
    bench.tell(ask("a", "v w"))
    bench.tell(ask("b", "w"))
    bench.run(1.0)
    assert bench.runs("b") == [(0, None)]
    bench.run(10.0)
    assert bench.runs("a") == [(5.0, 10.0)]
    assert REPAIR_S < 5.0
    assert bench.verdict() == []


def test_an_arc_that_cannot_open_its_gate_lets_others_run_and_is_asked_again():
    bench = Bench(manager(), unit("v"))
    bench.fails["a"] = ""
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v", run_s=0.4))
    bench.run(0.5)
    assert bench.runs("b") == [(0, None)]
    bench.run(3.0)
    assert bench.runs("a") == [(RETRY_S, None)]
    assert bench.verdict() == []


def test_less_capacity_takes_the_rcs_of_the_last_in_order():
    bench = Bench(manager(), sharable("r"))
    for name in ("a", "b", "c"):
        bench.tell(ask(name, {"r": load(0.3)}))
    bench.tell(CapacityChanged("r", 0.7))
    bench.run(0.0)
    assert [order.arc for order in all_of(bench, RevokeArc)] == ["c"]
    assert all_of(bench, RevokeArc)[0].why == "capacity"
    assert bench.verdict() == []


def test_a_changed_priority_decides_at_once():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v", priority=2))
    bench.tell(ask("b", "v", priority=1))
    bench.at(7.0, PriorityChanged("owner-b", 3))
    bench.run(20.0)
    assert bench.runs("a") == [(0, 7)]
    assert bench.runs("b") == [(7, None)]
    assert bench.verdict() == []


# Restart.


def test_a_restarted_manager_lets_who_holds_run_on_to_the_end_of_its_slice():
    bench = Bench(manager(), unit("v"))
    bench.now_s = 1.0
    request = ask("a", "v")
    bench.tell(Adopted(request.request, {"v": 7}, 1.0))
    bench.now_s = 3.0
    bench.tell(ask("b", "v"))
    bench.run(20.0)
    assert bench.runs("a")[:2] == [(1, 6), (11, 16)]
    assert [order.epochs["v"] for order in all_of(bench, ConnectArc)] == [8, 9, 10]
    assert [(lease.arc, lease.epoch) for lease in bench.manager.leases()] == [("b", 10)]
    assert bench.verdict() == []


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
