"""How sure a counted rate is."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_control.laboratory.experiments.intervals import standard_errors_apart, wilson


@pytest.mark.parametrize(
    ("detected", "trials", "low", "high"),
    [(16, 20, 58, 92), (15, 20, 53, 89), (12, 20, 39, 78), (10, 20, 30, 70), (18, 22, 61, 93)],
)
def test_wilson_s_intervals_of_the_papers_counts(detected: int, trials: int, low: int, high: int) -> None:
    found = wilson(detected, trials)
    assert [round(100 * bound) for bound in found] == [low, high]


@given(st.integers(1, 500).flatmap(lambda trials: st.tuples(st.integers(0, trials), st.just(trials))))
def test_the_rate_is_in_its_interval_and_the_interval_mirrors(count: tuple[int, int]) -> None:
    detected, trials = count
    low, high = wilson(detected, trials)
    assert 0 <= low <= detected / trials + 1e-12
    assert detected / trials - 1e-12 <= high <= 1
    mirrored = wilson(trials - detected, trials)
    assert (1 - mirrored[1], 1 - mirrored[0]) == pytest.approx((low, high))


@pytest.mark.parametrize(("detected", "trials"), [(1, 0), (-1, 5), (6, 5)])
def test_what_is_no_count_is_refused(detected: int, trials: int) -> None:
    with pytest.raises(ValueError, match="no rate"):
        wilson(detected, trials)


def test_a_certain_prediction_may_be_missed_by_one() -> None:
    assert abs(standard_errors_apart(199, 200, 1.0)) < 3 < abs(standard_errors_apart(190, 200, 1.0))
