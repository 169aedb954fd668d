"""A console that asks and leaves again and again cannot keep behaviors from running."""

from __future__ import annotations

import pytest
from simulated_switches import Bench, ask, manager, unit

from backbone.scheduling.events import Departed, Idled, Wanted

V = unit("v", connect_s=0.3, disconnect_s=0.05)


def share_of_time(bench: Bench, arc: str) -> float:
    return sum((end_s or bench.now_s) - start_s for start_s, end_s in bench.runs(arc)) / bench.now_s


@pytest.mark.parametrize("by", ["idling", "leaving"])
def test_a_console_that_asks_and_leaves_fifty_times_a_second_costs_a_behavior_little(by):
    bench = Bench(manager(grace_s=0.2), V)
    bench.tell(ask("behavior", "v", priority=1))
    console = ask("console", "v", path=[("anna", 9)], console=True)
    for number in range(50 * 60):
        again = console if number == 0 or by == "leaving" else Wanted("console")
        bench.at(0.02 * number, again)
        bench.at(0.02 * number + 0.01, Departed("console") if by == "leaving" else Idled("console"))
    bench.run(120.0)
    assert bench.runs("console") == []
    assert share_of_time(bench, "behavior") > 0.8
    assert bench.verdict() == []


def test_an_operator_who_thinks_better_of_it_thrice_still_takes_over_at_once():
    bench = Bench(manager(grace_s=0.2), V)
    bench.tell(ask("behavior", "v", priority=1))
    for number in range(4):
        bench.at(5.0 + number, ask("console", "v", path=[("anna", 9)], console=True))
        if number < 3:
            bench.at(5.1 + number, Departed("console"))
    bench.run(10.0)
    assert bench.runs("console") == [(pytest.approx(8.35, abs=0.05), None)]


def test_who_is_damped_is_told_and_comes_in_by_itself():
    bench = Bench(manager(), V)
    bench.tell(ask("behavior", "v", priority=1))
    bench.run(1.0)
    console = ask("console", "v", path=[("anna", 9)], console=True)
    for number in range(5):
        bench.run(1.0 + 0.1 * number)
        bench.tell(console)
        bench.tell(Departed("console"))
    bench.tell(console)
    why = bench.answers.why("console", bench.now_s)
    assert "again and again; again at" in why.lines[0]
    assert bench.run(20.0).runs("console")
    assert bench.verdict() == []


def test_an_operator_who_had_the_robot_before_a_higher_one_took_it_has_not_left_in_vain():
    bench = Bench(manager(grace_s=0.05), unit("v", connect_s=0.02, disconnect_s=0.01))
    bench.tell(ask("behavior", "v", priority=1))
    begins_s = [5.0 + 0.5 * number for number in range(12)]
    for begin_s in begins_s:
        bench.at(begin_s, ask("anna-drive", "v", path=[("anna", 9)], console=True))
        bench.at(begin_s + 0.15, ask("ben-drive", "v", path=[("ben", 10)], console=True))
        bench.at(begin_s + 0.30, Departed("anna-drive"))
        bench.at(begin_s + 0.35, Departed("ben-drive"))
    bench.run(15.0)
    granted_s = [start_s for start_s, _end_s in bench.runs("anna-drive")]
    assert granted_s == [pytest.approx(begin_s, abs=0.1) for begin_s in begins_s]
    assert bench.verdict() == []
