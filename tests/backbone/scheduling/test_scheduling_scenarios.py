"""The scenarios that distinguish readings of the papers: H priority 2, L priority 1, 5 s slices."""

from __future__ import annotations

import pytest
from simulated_switches import MISSION, Bench, ask, load, manager, sharable, unit

from backbone.scheduling.events import Departed

UNITS = [unit(name) for name in ("v", "r1", "r2", "w", "s1")]
H1 = ask("h1", "v r1", priority=2)
H2 = ask("h2", "v r2", priority=2)


def mission(*requests, policy="no_delay", rcs=UNITS, until_s=40.0):
    bench = Bench(manager(policy=policy), *rcs)
    for request in requests:
        bench.tell(request)
    bench.run(until_s)
    return bench


def test_s1_two_equals_alternate_while_an_independent_lower_one_always_runs():
    bench = mission(H1, H2, ask("l", "w"))
    assert bench.runs("h1") == [(0, 5), (10, 15), (20, 25), (30, 35), (40, None)]
    assert bench.runs("h2") == [(5, 10), (15, 20), (25, 30), (35, 40)]
    assert bench.runs("l") == [(0, None)]
    assert bench.verdict() == []


def test_s2_a_lower_one_fills_exactly_the_slots_in_which_it_delays_nobody():
    bench = mission(H1, H2, ask("l", "r2"))
    assert bench.runs("l") == bench.runs("h1")
    assert bench.runs("h2") == mission(H1, H2).runs("h2")
    assert bench.verdict() == []


def test_s2_holds_with_hand_over_times_too():
    """The hand-over must not eat the gap of a lower ARC whose slice is just as long."""
    rcs = [unit(name, connect_s=0.3, disconnect_s=0.05) for name in ("v", "r1", "r2")]
    bench = mission(H1, H2, ask("l", "r2"), rcs=rcs, until_s=60.0)
    assert bench.runs("h2") == mission(H1, H2, rcs=rcs, until_s=60.0).runs("h2")
    assert len(bench.runs("l")) == len(bench.runs("h1"))
    assert bench.verdict() == []


def test_s3_a_lower_one_on_the_same_frequency_starves_visibly():
    bench = mission(H1, H2, ask("l", "v"))
    assert bench.runs("l") == []
    why = bench.answers.why("l", bench.now_s)
    assert why.rule == "9"
    assert set(why.blockers) & {"h1", "h2"}
    assert "40.0 s" in why.lines[0]
    assert bench.verdict() == []


def test_s4_a_lower_one_that_needs_longer_than_the_slots_never_runs():
    bench = mission(H1, H2, ask("l", "r2", run_s=8.0))
    assert bench.runs("l") == []
    assert bench.verdict() == []


def test_s5_capacity_goes_to_the_higher_ones():
    bench = mission(
        ask("h1", {"r": load(0.4)}, priority=2),
        ask("h2", {"r": load(0.4)}, priority=2),
        ask("l", {"r": load(0.3)}),
        rcs=[sharable("r")],
    )
    assert bench.runs("h1") == bench.runs("h2") == [(0, None)]
    assert bench.runs("l") == []
    assert bench.verdict() == []


def test_s6_the_lower_one_runs_when_both_higher_ones_have_released():
    bench = Bench(manager(), *UNITS)
    for request in (H1, H2, ask("l", "v")):
        bench.tell(request)
    bench.at(11.0, Departed("h1"))
    bench.at(18.0, Departed("h2"))
    bench.run(30.0)
    assert bench.runs("l") == [(18, None)]
    assert bench.verdict() == []


@pytest.mark.parametrize(("priority", "starts_s"), [(100, 2.0), (0, 5.0)])
def test_s7_s8_a_console_overrides_at_once_only_if_it_is_higher(priority, starts_s):
    bench = Bench(manager(), *UNITS)
    bench.tell(ask("b", "v s1"))
    bench.at(2.0, ask("c", "v s1", priority=priority, console=True))
    bench.run(4.0 if priority else 16.0)
    assert bench.runs("c")[0][0] == starts_s
    if priority:
        bench.tell(Departed("c"))
        bench.tell(ask("b2", "v"))
        bench.run(20.0)
        assert bench.runs("b") == [(0, 2), (4, 9), (14, 19)]
    else:
        assert bench.runs("b") == [(0, 5), (10, 15)]
        assert bench.runs("c") == [(5, 10), (15, None)]
    assert bench.verdict() == []


def test_an_order_has_the_priority_of_its_console_in_the_trace_too():
    """Its own number counts only among the orders of this console; the number of the mission's node is 0."""
    bench = Bench(manager(), *UNITS)
    bench.tell(ask("b", "v s1"))
    order = ask("anna-order-1-drive", "v s1", path=[("anna", 100), ("anna-order-1", -1)], console=True)
    bench.at(2.0, order)
    bench.at(3.0, ask("anna-drive", "v s1", path=[("anna", 100)], console=True))
    bench.at(4.0, Departed("anna-drive"))
    bench.at(5.0, Departed("anna-order-1-drive"))
    bench.run(20.0)
    assert bench.runs("b") == [(0, 2), (5, None)]
    assert bench.verdict() == []


def test_s9_each_group_switches_on_its_own_clock():
    a, b = ask("a", "v"), ask("b", "v")
    c, d = ask("c", "w", run_s=3.0), ask("d", "w", run_s=3.0)
    together = mission(a, c, b, d)
    for name, alone in (("a", mission(a, b)), ("c", mission(c, d))):
        assert together.runs(name) == alone.runs(name)
    assert together.runs("a")[1][0] == 10
    assert together.runs("c")[1][0] == 6
    assert together.verdict() == []


def test_s10_under_strict_a_lower_one_never_runs_while_a_higher_one_waits():
    bench = mission(H1, H2, ask("l", "r2"), policy="strict")
    assert bench.runs("l") == []
    assert bench.verdict() == []


def test_an_rc_does_not_stay_free_for_one_that_the_strict_policy_holds_back_for_ever():
    """A console keeps v, so ``waits`` holds ``held`` back for ever; ``other`` is an equal of ``held`` and later."""

    def of(arc: str, rcs: str, parent: str, priority: int):
        return ask(arc, rcs, path=[(MISSION, 0), (parent, 1), (arc, priority)])

    bench = Bench(manager(policy="strict"), unit("v"), unit("w"))
    bench.tell(ask("person", "v", path=[("person", 100)], console=True))
    for each in (
        of("first", "w", "p", 3),
        of("waits", "v", "p", 2),
        of("held", "w", "p", 1),
        of("both", "v w", "p", 0),
    ):
        bench.tell(each)
    bench.at(1.0, of("other", "w", "q", 1))
    bench.at(3.0, Departed("first"))
    bench.run(60.0)
    assert bench.verdict() == []
    assert bench.runs("other") == [(3.0, None)]
    assert bench.runs("held") == bench.runs("waits") == []


@pytest.mark.parametrize(("count", "share", "fit"), [(3, 0.4, 2), (4, 0.4, 2), (5, 0.3, 3), (4, 0.3, 3)])
def test_of_equals_on_a_radio_each_stays_for_as_many_slices_as_fit_at_once(count, share, fit):
    """Rule 5, last sentence: with one switch for each slice that ends, and none that undoes itself."""
    bench = mission(
        *(ask(f"a{n}", {"r": load(share)}) for n in range(count)), rcs=[sharable("r")], until_s=5.0 * 12 * count
    )
    had_s = [sum((end_s or bench.now_s) - start_s for start_s, end_s in bench.runs(f"a{n}")) for n in range(count)]
    assert had_s == pytest.approx([bench.now_s * fit / count] * count, abs=10.0)
    lost = {(line["arc"], line["t"]) for line in bench.trace if line["ev"] == "revoke"}
    assert not [line for line in bench.trace if line["ev"] == "connect" and (line["arc"], line["t"]) in lost]
    assert bench.verdict() == []
