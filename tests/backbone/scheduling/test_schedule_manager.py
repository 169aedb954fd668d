"""Context switches, wishes and faults, as the schedule manager decides on them."""

import gc

import pytest
from simulated_switches import REPAIR_S, Bench, all_of, ask, load, manager, sharable, states, unit

from backbone.scheduling.arc_events import LONGEST_RETRY_S, RETRY_S
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
    RcUse,
)

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


def test_a_new_slice_of_one_that_stays_lets_a_small_one_start_in_the_same_decision():
    """``whole`` now waits for the end of the new slice; until then ``small`` fits beside all others."""
    bench = Bench(manager(), sharable("r", disconnect_s=0.25))
    for arc in ("first", "second", "stays"):
        bench.tell(ask(arc, {"r": load(0.3)}))
    bench.at(1.0, ask("next", {"r": load(0.55)}, run_s=1.0))
    bench.at(2.0, ask("whole", {"r": load(0.95)}))
    bench.at(4.0, ask("small", {"r": load(0.1)}, run_s=2.5))
    bench.run(8.0)
    assert [(line["arc"], line["t"]) for line in bench.trace if line["ev"] == "slice"] == [("stays", 5.0)]
    assert bench.runs("small")[0][0] == 5.0
    assert bench.runs("next")[0][0] == 5.25
    assert bench.verdict() == []


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


class Lasting(dict[str, str]):
    """Failures that come again with each connection."""

    def pop(self, arc: str) -> str:
        return self[arc]


def test_an_arc_that_never_opens_its_gate_leaves_lower_ones_whole_slices():
    bench = Bench(manager(), unit("v", connect_s=0.1))
    bench.fails = Lasting(a="")
    bench.tell(ask("a", "v", priority=2))
    bench.tell(ask("b", "v"))
    bench.run(120.0)
    lengths_s = [end_s - start_s for start_s, end_s in bench.runs("b") if end_s]
    assert len(lengths_s) <= 8
    assert lengths_s[-1] > 2 * 5.0
    bench.fails.clear()
    bench.run(120.0 + LONGEST_RETRY_S)
    assert bench.runs("a")
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


def test_priorities_set_to_ever_other_numbers_take_no_memory():
    bench = Bench(manager(), unit("v"))
    bench.tell(ask("a", "v"))
    bench.tell(ask("b", "v"))
    for number in range(1000):
        bench.tell(PriorityChanged(f"owner-{'ab'[number % 2]}", 10 + number))
        bench.run(bench.now_s + 0.1)
    levels = [bench.manager.master_schedule.state.arcs[arc].level for arc in ("a", "b")]
    reached = gc.get_referrers(*levels)
    assert max(len(one) for one in reached if isinstance(one, dict)) < 100
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
