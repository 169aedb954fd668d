"""Shares are those of the trace: between two re-plannings and over the last minutes, against a plain recount."""

from __future__ import annotations

import pickle
from itertools import pairwise
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_missions import END_S, play, random_mission
from simulated_switches import MISSION, Bench, ask, load, manager, sharable, unit

from backbone.scheduling.events import Departed, PriorityChanged
from backbone.scheduling.shares import PERIODS_KEPT, Shares
from backbone.scheduling.step_average import SLOT_S
from backbone.scheduling.views import RcUtilization

V, W = unit("v"), unit("w")


def counted(bench: Bench) -> dict[str, RcUtilization]:
    shares = Shares()
    for rc in bench.rcs:
        shares.know(rc.rc, 0.0)
    for line in bench.trace:
        shares.take(line)
    return {one.rc: one for one in shares.utilizations(bench.now_s, periods=True)}


def holds(bench: Bench, rc: str) -> list[tuple[str, float, float, float]]:
    """Return ARC, share of the RC's time, begin and end of each hold, by the lines alone."""
    wishes: dict[str, Any] = {}
    held: dict[str, tuple[float, float]] = {}
    found = []
    for line in bench.trace:
        arc, now_s = line.get("arc"), line["t"]
        if line["ev"] == "request":
            wishes[arc] = line["use"]
        elif line["ev"] == "connect" and rc in wishes[arc]:
            use = wishes[arc][rc]
            held[arc] = (1.0 if use == "x" else sum(one["cost"] / one["period"] for one in use), now_s)
        elif line["ev"] == "free" and arc in held:
            share, since_s = held.pop(arc)
            found.append((arc, share, since_s, now_s))
    return [*found, *((arc, share, since_s, bench.now_s) for arc, (share, since_s) in held.items())]


def capacities(bench: Bench, rc: str) -> list[tuple[float, float]]:
    lines = [line for line in bench.trace if line.get("id") == rc and "cap" in line]
    return [(0.0, 1.0), *((line["t"], line["cap"]) for line in lines)]


def recount(bench: Bench, rc: str, since_s: float, until_s: float) -> float:
    """Return the average utilization, one instant interval after the other."""
    if until_s <= since_s:
        return 0.0
    of, steps = holds(bench, rc), capacities(bench, rc)
    cuts = sorted({since_s, until_s, *(at for _, _, *both in of for at in both), *(at for at, _ in steps)})
    total = 0.0
    for begin_s, end_s in pairwise(cut for cut in cuts if since_s <= cut <= until_s):
        capacity = [value for at_s, value in steps if at_s <= begin_s][-1]
        given_out = sum(share for _, share, from_s, to_s in of if from_s <= begin_s and end_s <= to_s)
        use = (min(1.0, given_out / capacity) if capacity > 0 else 1.0) if given_out > 1e-12 else 0.0
        total += use * (end_s - begin_s)
    return total / (until_s - since_s)


@given(st.integers(0, 2**32))
def test_they_are_those_of_the_trace(seed):
    bench = play(*random_mission(Random(seed)))
    for rc, one in counted(bench).items():
        since_s = max(0.0, (END_S - 60.0) // SLOT_S * SLOT_S)
        assert one.minute == pytest.approx(recount(bench, rc, since_s, END_S), abs=1e-6)
        assert one.ten_minutes == pytest.approx(recount(bench, rc, 0.0, END_S), abs=1e-6)
        assert 0 <= one.minute <= 1
        assert 0 <= one.ten_minutes <= 1
        for before, after in pairwise(one.periods):
            assert before.since_s < before.until_s == after.since_s
        assert one.periods[-1].until_s < 0
        for period in one.periods:
            until_s = period.until_s if period.until_s >= 0 else END_S
            assert all(0 <= share <= 1 for share in period.shares.values())
            capacity = [value for at_s, value in capacities(bench, rc) if at_s <= period.since_s][-1]
            for arc, share in period.shares.items():
                had_s = sum(
                    of * max(0.0, min(to_s, until_s) - max(from_s, period.since_s))
                    for name, of, from_s, to_s in holds(bench, rc)
                    if name == arc
                )
                lasts_s = until_s - period.since_s
                expected = min(1.0, had_s / lasts_s / capacity) if lasts_s > 0 and capacity > 0 else share
                assert share == pytest.approx(expected, abs=1e-6)


def test_a_console_that_takes_part_shortens_the_others_shares():
    bench = Bench(manager(), V)
    bench.tell(ask("one", "v"))
    bench.tell(ask("two", "v"))
    bench.at(60.0, ask("console", "v", path=[("anna", 0)], console=True))
    bench.at(105.0, Departed("console"))
    bench.run(125.0)
    before, during, after = counted(bench)["v"].periods
    assert before.because == "it is known; one asks; two asks"
    assert before.shares == {"one": pytest.approx(0.5), "two": pytest.approx(0.5)}
    assert (during.since_s, during.until_s, during.because) == (60.0, 105.0, "console asks")
    assert during.shares == {name: pytest.approx(1 / 3) for name in ("one", "two", "console")}
    assert after.because == "console leaves"
    assert set(after.shares) == {"one", "two"}
    assert sum(after.shares.values()) == pytest.approx(1.0)


def test_of_a_radio_they_are_shares_of_its_capacity():
    bench = Bench(manager(), sharable("radio", 0.5), V)
    bench.tell(ask("one", {"radio": load(0.1)}))
    bench.tell(ask("two", {"radio": load(0.3)}))
    bench.run(20.0)
    found = counted(bench)
    assert found["radio"].minute == pytest.approx(0.8)
    assert found["radio"].periods[-1].shares == {"one": pytest.approx(0.2), "two": pytest.approx(0.6)}
    assert found["v"].minute == 0.0


def test_a_changed_priority_is_a_re_planning_of_what_is_asked_for():
    bench = Bench(manager(), V, W)
    bench.tell(ask("one", "v"))
    bench.tell(ask("two", "v"))
    bench.at(20.0, PriorityChanged("owner-two", 5))
    bench.run(40.0)
    found = counted(bench)
    assert found["v"].periods[-1].because == f"{MISSION}/owner-two has priority 5"
    assert found["v"].periods[-1].shares == {"two": pytest.approx(1.0)}
    assert len(found["w"].periods) == 1


def test_what_is_kept_is_bounded():
    shares, sizes = Shares(), []
    shares.know("v", 0.0)
    for number in range(1000, 1800):
        shares.take({"ev": "request", "t": float(number), "arc": f"a{number}", "use": {"v": "x"}})
        shares.take({"ev": "connect", "t": float(number), "arc": f"a{number}"})
        shares.take({"ev": "depart", "t": number + 0.5, "arc": f"a{number}"})
        shares.take({"ev": "free", "t": number + 0.75, "arc": f"a{number}"})
        sizes.append(len(pickle.dumps(shares)))
    (one,) = shares.utilizations(1800.0, periods=True)
    assert len(one.periods) == PERIODS_KEPT
    assert one.ten_minutes == pytest.approx(0.75, abs=0.01)
    assert max(sizes[700:]) <= max(sizes[:700]) + 10


def test_an_rc_that_is_forgotten_counts_no_more():
    shares = Shares()
    shares.know("v", 0.0)
    shares.take({"ev": "request", "t": 0.0, "arc": "a", "use": {"v": "x", "w": "x"}})
    shares.take({"ev": "connect", "t": 0.0, "arc": "a"})
    shares.forget("v")
    shares.take({"ev": "free", "t": 1.0, "arc": "a"})
    assert shares.utilizations(1.0, periods=True) == []
