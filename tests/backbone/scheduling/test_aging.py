"""Aging: an ARC that waits rises one level each time ``aging_s`` have passed, until it is served or wants no time."""

from __future__ import annotations

from simulated_switches import Bench, ask, manager, unit

from backbone.scheduling.events import Departed, Idled


def test_the_schedule_does_not_call_a_wait_endless_that_aging_ends():
    """``why`` named the time of the grant, and the schedule said that the higher ARC stays until it idles."""
    bench = Bench(manager(aging_s=4.0), unit("v"))
    bench.tell(ask("guard", "v", priority=3))
    bench.tell(ask("tour", "v", priority=1))
    bench.run(5.0)
    tour = next(one for one in bench.answers.schedule(5.0).requests if one.arc == "tour")
    assert tour.expected_start_s < 0
    assert tour.because.endswith("guard, higher, stays until it releases or idles, unless tour rises meanwhile (aging)")


def test_with_aging_a_lower_one_that_waited_long_gets_one_whole_slice():
    """After 10 s it is as high as the other, whose slice is over."""
    bench = Bench(manager(aging_s=10.0), unit("v"))
    bench.tell(ask("high", "v", priority=2))
    bench.tell(ask("low", "v", priority=1))
    bench.run(50.0)
    assert bench.runs("low") == [(10.0, 15.0), (25.0, 30.0), (40.0, 45.0)]
    assert bench.runs("high")[1] == (15.0, 25.0)


def test_aging_outwaits_no_console():
    bench = Bench(manager(aging_s=1.0), unit("v"))
    bench.tell(ask("human", "v", priority=9, console=True))
    bench.tell(ask("low", "v"))
    bench.run(100.0)
    assert bench.runs("low") == []


def test_an_arc_that_rose_and_was_served_comes_down_although_it_runs_on():
    """``low`` rises to ``high``; once it was served it is lower than ``middle``."""
    bench = Bench(manager(aging_s=10.0), unit("v"))
    bench.tell(ask("high", "v", priority=3))
    bench.tell(ask("low", "v", priority=1))
    bench.at(22.0, Departed("high"))
    bench.at(30.0, ask("middle", "v", priority=2))
    bench.run(40.0)
    assert bench.runs("low")[0] == (20.0, 30.0)
    assert bench.runs("middle") == [(30.0, 40.0)]
    assert bench.verdict() == []


def test_a_branch_comes_down_when_its_arc_that_rose_wants_no_time_any_more():
    """A node rises with all above it, so a sibling that asks later would be as high as the one that waited."""
    bench = Bench(manager(aging_s=10.0), unit("v"))
    bench.tell(ask("high", "v", priority=3))
    bench.tell(ask("low", "v", path=[("watch", 0), ("branch", 1), ("low", 1)]))
    bench.at(22.0, Departed("high"))
    bench.at(23.0, Idled("low"))
    bench.at(30.0, ask("sibling", "v", path=[("watch", 0), ("branch", 1), ("sibling", 1)]))
    bench.at(31.0, ask("middle", "v", priority=2))
    bench.run(40.0)
    assert bench.runs("low") == [(20.0, 23.0)]
    assert bench.runs("sibling") == [(30.0, 31.0)]
    assert bench.runs("middle") == [(31.0, None)]
    assert bench.verdict() == []


def test_an_arc_that_waits_for_its_own_parent_starves_nobody_else():
    """It never gets higher than its parent, but raised it, for ever: the parent kept its RC from all others."""
    bench = Bench(manager(aging_s=1.0), unit("v"))
    bench.tell(ask("parent", "v", path=[("watch", 0), ("parent", 1)]))
    bench.tell(ask("child", "v", path=[("watch", 0), ("parent", 1), ("child", 1)]))
    bench.tell(ask("other", "v", path=[("watch", 0), ("other", 1)]))
    bench.run(60.0)
    assert len(bench.runs("other")) >= 5
    assert len(bench.runs("parent")) >= 5
    child = next(one for one in bench.answers.schedule(60.0).requests if one.arc == "child")
    assert "aging" not in child.because
    assert bench.verdict() == []


def test_an_arc_that_waited_for_its_own_parent_has_risen_when_the_parent_ends():
    bench = Bench(manager(aging_s=10.0), unit("v"))
    bench.tell(ask("parent", "v", path=[("watch", 0), ("parent", 1)]))
    bench.tell(ask("child", "v", path=[("watch", 0), ("parent", 1), ("child", 1)]))
    bench.at(12.0, ask("high", "v", priority=2))
    bench.at(20.0, Departed("parent"))
    bench.run(60.0)
    assert bench.runs("child")[0][0] <= 25.0
    assert bench.verdict() == []


def test_an_arc_that_fits_beside_its_parent_rises():
    bench = Bench(manager(aging_s=2.0), unit("v"), unit("w"))
    bench.tell(ask("parent", "w", path=[("watch", 0), ("parent", 1)]))
    bench.tell(ask("high", "v", priority=3))
    bench.tell(ask("child", "v", path=[("watch", 0), ("parent", 1), ("child", 1)]))
    bench.run(30.0)
    assert bench.runs("child")


def test_an_arc_that_rose_and_was_overridden_keeps_its_level_until_it_is_served():
    """It fell to its own number, and a long slice was cut again and again by an ARC that had risen meanwhile."""
    bench = Bench(manager(aging_s=2.0), unit("v"))
    bench.tell(ask("high", "v", priority=3))
    bench.tell(ask("low", "v", priority=1, run_s=3.0))
    bench.at(5.5, Departed("high"))
    bench.at(6.0, ask("human", "v", priority=9, console=True))
    bench.at(6.5, ask("middle", "v", priority=2))
    bench.at(7.0, Departed("human"))
    bench.run(20.0)
    assert bench.runs("low")[:2] == [(5.0, 6.0), (7.0, 10.0)]
    assert bench.runs("middle")[0][0] == 10.0
    assert bench.verdict() == []
