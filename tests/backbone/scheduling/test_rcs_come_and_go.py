"""RCs are added to a running schedule and removed from it; the rest of the schedule goes on by the rules."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_missions import END_S, play, random_mission
from simulated_switches import Bench, ask, load, manager, sharable, unit
from test_scheduling_laws import violations

from backbone.scheduling.events import Departed, RcRemoved, RcWentDown
from backbone.scheduling.requests import UnknownRc

V, W = unit("v"), unit("w")


def test_an_rc_that_is_added_can_be_asked_for_at_once():
    bench = Bench(manager(), V)
    bench.run(3.0)
    with pytest.raises(UnknownRc):
        bench.manager.choose(ask("one", "w").request)
    bench.tell(W)
    bench.tell(ask("one", "w"))
    assert bench.runs("one") == [] or bench.runs("one") == [(3.0, None)]
    assert bench.run(4.0).runs("one") == [(3.0, None)]
    assert bench.verdict() == []


def test_an_rc_that_is_removed_is_gone():
    bench = Bench(manager(), V, W)
    bench.tell(RcWentDown("w"))
    bench.tell(RcRemoved("w"))
    assert not bench.manager.knows("w")
    assert [rc.rc for rc in bench.answers.schedule(bench.now_s).rcs] == ["v"]
    with pytest.raises(UnknownRc):
        bench.manager.choose(ask("one", "w").request)
    bench.tell(ask("late", "w"))
    assert bench.answers.schedule(bench.now_s).requests == []


def test_why_names_both_things_that_bring_an_rc_back():
    """Its process may answer all the time, and refuse each connection because its device does not obey."""
    bench = Bench(manager(), W)
    bench.tell(RcWentDown("w"))
    assert bench.answers.why("w", 0.0).would_change == "its process answers, and its hardware is in the safe state"


def test_an_rc_that_is_up_or_asked_for_stays_until_it_is_neither():
    bench = Bench(manager(), V, W)
    bench.tell(RcRemoved("w"))
    assert bench.manager.knows("w"), "it is up"
    bench.tell(ask("one", "w"))
    bench.tell(RcWentDown("w"))
    bench.run(1.0)
    bench.tell(RcRemoved("w"))
    assert bench.manager.knows("w"), "a request names it"
    bench.tell(Departed("one"))
    bench.run(2.0)
    bench.tell(RcRemoved("w"))
    assert not bench.manager.knows("w")
    assert bench.verdict() == []


def test_a_request_that_is_to_follow_keeps_the_rc_it_names():
    bench = Bench(manager(), unit("v", disconnect_s=1.0), unit("w", up=False))
    bench.tell(ask("one", "v"))
    bench.run(1.0)
    bench.tell(ask("one", "w"))
    bench.tell(RcRemoved("w"))
    assert bench.manager.knows("w")
    bench.run(5.0)
    assert [request.rcs for request in bench.answers.schedule(5.0).requests] == [["w"]]


def test_a_name_may_return_for_another_rc():
    bench = Bench(manager(), V, sharable("w"))
    bench.tell(ask("one", {"w": load(0.3)}))
    bench.at(2.0, Departed("one"))
    bench.at(3.0, RcWentDown("w"))
    bench.at(3.0, RcRemoved("w"))
    bench.at(4.0, W)
    bench.at(5.0, ask("two", "v w"))
    bench.run(10.0)
    assert bench.runs("two") == [(5.0, None)]
    assert bench.verdict() == []


@given(st.integers(0, 2**32))
def test_the_checker_finds_nothing_when_rcs_come_and_go(seed):
    rng = Random(seed)
    bench, happens = random_mission(rng)
    for _ in range(rng.randint(1, 4)):
        rc, begin_s = rng.choice(bench.rcs), rng.randint(0, 200) / 4
        bench.at(begin_s, RcWentDown(rc.rc))
        for again in range(rng.randint(1, 8)):
            bench.at(begin_s + again / 2, RcRemoved(rc.rc))
        if rng.random() < 0.7:
            bench.at(begin_s + rng.randint(0, 40) / 4, rc)
    assert violations(play(bench, happens, END_S)) == []
