"""Run times that a behavior works out for itself."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_control.behaviors.run_times import useful_run_times

times = st.floats(0.01, 20.0)


@given(times, times, times, times, times)
def test_never_more_than_the_mission_gives_and_always_room_for_one_more_detection(
    view_s: float, settling_s: float, blind_s: float, detect_s: float, given_s: float
) -> None:
    found = useful_run_times(view_s=view_s, settling_s=settling_s, blind_s=blind_s, detect_s=detect_s, given_s=given_s)
    assert 0 < found.minimum_s <= given_s
    assert found.maximum_s >= found.minimum_s + detect_s - 1e-6


@given(times, times, times)
def test_slices_are_short_only_where_short_ones_pay(settling_s: float, blind_s: float, detect_s: float) -> None:
    pays_s = settling_s + blind_s + 2 * detect_s
    for view_s, short in ((0.99 * pays_s, False), (1.01 * pays_s, True)):
        found = useful_run_times(
            view_s=view_s, settling_s=settling_s, blind_s=blind_s, detect_s=detect_s, given_s=1000.0
        )
        assert (found.minimum_s < 1000.0) is short


@pytest.mark.parametrize("wrong", [-1.0, math.nan, math.inf])
def test_times_that_are_none_are_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="no run times"):
        useful_run_times(view_s=wrong, settling_s=0.3, blind_s=0.5, detect_s=0.8, given_s=5.0)
