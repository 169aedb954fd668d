"""Pace of a motion control: steps keep to their grid after any delay, and late ones are counted."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.walker.pace import Pace

STEP_S = 0.02


def test_steps_in_time_are_a_step_apart_and_none_is_late() -> None:
    pace, times_s = Pace(STEP_S), []
    pace.begin(7.0)
    for _ in range(50):
        times_s.append(pace.due_s)
        pace.step(pace.due_s)
    assert times_s == pytest.approx([7.0 + number * STEP_S for number in range(50)])
    assert pace.statistics() == {"steps": 50, "late": 0, "worst_ms": 0.0}


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=40))
def test_the_next_step_is_the_first_of_the_grid_after_this_one(delays_s: list[float]) -> None:
    pace = Pace(STEP_S)
    pace.begin(0.0)
    for delay_s in delays_s:
        now_s = pace.due_s + delay_s
        pace.step(now_s)
        assert 0.0 <= pace.due_s - now_s <= STEP_S + 1e-9
        assert math.remainder(pace.due_s, STEP_S) == pytest.approx(0.0, abs=1e-9)
    assert pace.steps == len(delays_s)
    assert pace.late == pytest.approx(sum(delay_s > STEP_S / 2 for delay_s in delays_s), abs=0)
    assert pace.worst_s == pytest.approx(max(delays_s))


def test_a_step_that_begins_early_is_not_late() -> None:
    pace = Pace(STEP_S)
    pace.begin(1.0)
    pace.step(0.999)
    assert (pace.late, pace.due_s) == (0, pytest.approx(1.02))
