"""Large groups: what the planner keeps from one decision to the next never changes a decision."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from random import Random
from typing import Any

import pytest
from examples import share
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from random_missions import crowded_mission, fleet_mission, play
from simulated_switches import MISSION, Bench, ask, manager, sharable, states, unit

from backbone.scheduling import large_group, master_schedule, state
from backbone.scheduling.compatibility import Compatibility
from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.events import Departed
from backbone.scheduling.first_in_line import FirstInLine
from backbone.scheduling.large_group import LargeGroupPlanner
from backbone.scheduling.requests import RcUse, RequestState, Usage
from backbone.scheduling.table import Table

RULES: list[dict[str, Any]] = [{}, {"policy": "strict"}, {"discipline": "time"}, {"aging_s": 3.0}, {"grid_s": 2.0}]
FLEET_S = 20.0


class Forgetful(FirstInLine):
    """Keeps nothing from one look to the next."""

    def _look(self, now_s: float) -> None:
        for kept in (self._around, self._reserved, self._delayed):
            kept.clear()
        if self._state.fairness.discipline != "time":  # there a snapshot contains the first ARCs
            self._firsts.clear()
        super()._look(now_s)


class ForgetfulPlanner(LargeGroupPlanner):
    """Keeps nothing from one decision to the next, but the candidates."""

    def __init__(self, table: Table, *, slack_s: float) -> None:
        super().__init__(table, slack_s=slack_s)
        self._firsts = Forgetful(table, slack_s=slack_s)

    def _possible(self, now_s: float) -> Iterator[ArcEntry]:
        self._blocked.clear()
        return super()._possible(now_s)


class ForgetfulCompatibility(Compatibility):
    """Keeps no answer."""

    def fits(self, arc: ArcEntry, others: Iterable[ArcEntry]) -> bool:
        for kept in (self._usable, self._admitted, self._pairs):
            kept.clear()
        return super().fits(arc, others)


def crowd(seed: int, rules: dict[str, Any]) -> Bench:
    return play(*crowded_mission(Random(seed), exact_up_to=0, **rules))


def fleet(seed: int, rules: dict[str, Any]) -> Bench:
    return play(*fleet_mission(Random(seed), exact_up_to=0, **rules), until_s=FLEET_S)


@settings(max_examples=share(60), phases=[Phase.explicit, Phase.generate])  # to shrink a seed takes minutes, in vain
@given(played=st.sampled_from([crowd, fleet]), seed=st.integers(0, 2**32), rules=st.sampled_from(RULES))
@example(played=crowd, seed=167, rules={})  # differs if a reservation depends on earlier questions
@example(played=crowd, seed=294, rules={})
@example(played=crowd, seed=11, rules={"policy": "strict"})  # differs if a reservation stands after its time
@example(played=fleet, seed=332460, rules={})  # differs if a holder that is first in line again counts twice
def test_a_planner_that_keeps_nothing_decides_the_same(
    played: Callable[[int, dict[str, Any]], Bench], seed: int, rules: dict[str, Any]
) -> None:
    expected = played(seed, rules).trace
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(master_schedule, "LargeGroupPlanner", ForgetfulPlanner)
        patch.setattr(state, "Compatibility", ForgetfulCompatibility)
        assert played(seed, rules).trace == expected


def test_an_arc_that_made_way_twice_for_one_wait_lets_the_higher_one_go_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without this rule ``a5`` is connected at 29.1 s, and is revoked again for the same wait."""
    lets: set[tuple[float, str]] = set()

    class Watching(FirstInLine):
        def _makes_way(self, arc: ArcEntry) -> bool:
            makes_way = super()._makes_way(arc)
            if makes_way:
                lets.add((self._looked_s, arc.name))
            return makes_way

    monkeypatch.setattr(large_group, "FirstInLine", Watching)
    trace = crowd(10148, {"aging_s": 3.0}).trace
    assert any(arc == "a5" and time_s == pytest.approx(29.1) for time_s, arc in lets)
    assert not lets & {(row["t"], row["arc"]) for row in trace if row["ev"] == "connect"}


def test_answers_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    answers: list[bool] = []

    class Counting(FirstInLine):
        def _still_delays(self, arc: ArcEntry) -> bool:
            answers.append(super()._still_delays(arc))
            return answers[-1]

    monkeypatch.setattr(large_group, "FirstInLine", Counting)
    for seed in range(5):
        fleet(seed, {})
    assert answers.count(True) > 100


@pytest.mark.parametrize("seed", [2, 5, 6, 7])  # in these some ARC is revoked while a higher one waits
def test_the_start_behind_a_higher_arc_is_that_of_the_whole_estimate(seed: int) -> None:
    def starts(start_s: Callable[[LargeGroupPlanner, ArcEntry, float], float]) -> list[float]:
        found: list[float] = []

        def recorded(planner: LargeGroupPlanner, arc: ArcEntry, now_s: float) -> float:
            found.append(start_s(planner, arc, now_s))
            return found[-1]

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(LargeGroupPlanner, "start_s", recorded)
            crowd(seed, {})
        return found

    expected = starts(lambda planner, arc, now_s: planner.slots_around(arc, now_s)[0].start_s)
    assert starts(LargeGroupPlanner.start_s) == expected
    assert math.inf in expected


def test_a_request_that_is_first_in_no_line_examines_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    examined: list[set[str]] = []

    class Recording(LargeGroupPlanner):
        def _examine(self) -> None:
            super()._examine()
            examined.append({arc.name for arc in self._candidates})

    monkeypatch.setattr(master_schedule, "LargeGroupPlanner", Recording)
    bench = Bench(manager(exact_up_to=0), unit("camera"))
    for arc in ["runs", "first", "next"]:
        bench.tell(ask(arc, {"camera": RcUse()}))
    examined.clear()
    bench.tell(ask("last", {"camera": RcUse()}))
    assert set().union(*examined) == {"last"}


def test_a_new_first_in_line_lets_those_start_that_waited_for_the_former_one() -> None:
    bench = Bench(manager(exact_up_to=0), unit("robot"), unit("camera"))

    def asks(arc: str, *rcs: str, team: str = "", priority: int = 1) -> None:
        within = [(MISSION, 0), *([(team, 1)] if team else []), (arc, priority)]
        bench.tell(ask(arc, {rc: RcUse() for rc in rcs}, run_s=5.0, path=within))
        bench.run(bench.now_s + 1.0)

    asks("runs", "robot")  # the equal of all others, for it is in no team
    asks("first", "robot", "camera", team="team")
    asks("beside", "camera")
    assert states(bench)["beside"] is RequestState.WAITING
    asks("higher", "robot", team="team", priority=2)
    assert states(bench)["beside"] is RequestState.RUNNING
    assert bench.verdict() == []


def test_a_pair_of_a_known_kind_with_other_priorities_is_another_pair() -> None:
    urgent = RcUse([Usage(period_s=0.02, packet_time_s=0.001, deadline_s=0.005)])
    two_long = RcUse([Usage(period_s=0.02, packet_time_s=0.003)] * 2)
    bench = Bench(manager(), sharable("radio"))
    for arc, use, priority in [("a", urgent, 2), ("b", two_long, 1)]:
        bench.tell(ask(arc, {"radio": use}, path=[(MISSION, 0), (arc, priority)]))
    assert states(bench.run(1.0)) == {"a": RequestState.RUNNING, "b": RequestState.RUNNING}
    for arc in "ab":
        bench.tell(Departed(arc))
    for arc, use, priority in [("c", urgent, 1), ("d", two_long, 2)]:
        bench.tell(ask(arc, {"radio": use}, path=[(MISSION, 0), (arc, priority)]))
    assert states(bench.run(2.0)) == {"c": RequestState.WAITING, "d": RequestState.RUNNING}
    assert bench.verdict() == []
