"""``why`` where many ARCs wait: true for long waits, and cheap enough for the loop that renews the leases."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import pytest
from examples import rest_thorough
from simulated_switches import Bench, ask, load, manager, sharable, states, unit

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import Event, Instruction
from backbone.scheduling.requests import RcUse, RequestState
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.table import Table

NOW_S = 20.0
MOST_DECISIONS = 250  # measured: 0.1 s for 32 ARCs; leases last 2 s


def mesh(count: int) -> Bench:
    """Return a group in which each ARC shares two units and a radio with others."""
    dice = Random(1)
    units = [f"u{number}" for number in range(count // 3)]
    bench = Bench(manager(), sharable("radio", 1.0, 0.1, 0.05), *(unit(name, 0.1, 0.05) for name in units))
    for number in range(count):
        uses = {name: RcUse() for name in dice.sample(units, 2)} | {"radio": load(0.05)}
        bench.at(0.0, ask(f"a{number}", uses, priority=dice.randint(1, 3)))
    return bench.run(NOW_S)


def waiting(bench: Bench) -> list[str]:
    return [arc for arc, state in states(bench).items() if state is RequestState.WAITING]


@pytest.mark.parametrize("run_s", [30.0, 120.0])
def test_the_last_of_twelve_equals_hears_of_its_turn_after_many_minutes(run_s: float) -> None:
    """After five minutes of foresight came: without a predicted start, no gap is long enough for it."""
    bench = Bench(manager(), unit("v", 0.3, 0.1))
    for number in range(12):
        bench.tell(ask(f"a{number}", "v", run_s=run_s))
    bench.run(NOW_S)
    why = bench.answers.why("a11", NOW_S)
    assert why.expected_start_s == pytest.approx(11 * (run_s + 0.4) + 0.3)
    assert why.rule == "3"
    assert "no gap" not in why.lines[0]


@pytest.mark.parametrize("count", rest_thorough([15, 24]))
def test_what_why_says_of_an_rc_it_says_of_each_arc_that_waits_for_it(count: int) -> None:
    bench = mesh(count)
    lines = bench.answers.why("radio", NOW_S).lines
    whys = [bench.answers.why(arc, NOW_S) for arc in waiting(bench)]
    assert whys
    for why in whys:
        told = f"gets it at about {why.expected_start_s:.2f} s"
        expected = told if why.expected_start_s >= 0 else "waits for it without a predicted time"
        assert f"{why.name} {expected}" in lines


def test_foresight_ends_after_few_decisions(monkeypatch: pytest.MonkeyPatch) -> None:
    """One question about 32 ARCs took up to 1 s, during which no lease was renewed."""
    bench = mesh(32)
    decisions = 0
    handle = ScheduleManager.handle

    def counted(self: ScheduleManager, event: Event, now_s: float) -> list[Instruction]:
        nonlocal decisions
        decisions += 1
        return handle(self, event, now_s)

    monkeypatch.setattr(ScheduleManager, "handle", counted)
    requests = bench.answers.schedule(NOW_S).requests
    unforeseen = [r.arc for r in requests if r.state is RequestState.WAITING and r.expected_start_s < 0]
    for arc in unforeseen[:2]:
        decisions = 0
        bench.answers.why(arc, NOW_S)
        assert decisions <= MOST_DECISIONS


def test_the_group_of_an_rc_is_put_in_order_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was put in order for each ARC that waits for the RC: ``why`` took seconds, and holders lost their leases."""
    bench = mesh(66)
    times = 0
    in_order = Table.in_order

    def counted(self: Table, arcs: Sequence[ArcEntry]) -> list[ArcEntry]:
        nonlocal times
        times += 1
        return in_order(self, arcs)

    monkeypatch.setattr(Table, "in_order", counted)
    bench.answers.why("radio", NOW_S)
    assert times == 1
