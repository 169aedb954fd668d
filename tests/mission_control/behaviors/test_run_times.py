"""Run times that a behavior works out for itself."""

from __future__ import annotations

import math
from random import Random

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.ranges import A_DAY_S
from mission_control.behaviors.run_times import RunTimes, useful_run_times
from mission_control.behaviors.watch_for_motion import (
    LEAST_CLEAN,
    LEAST_HZ,
    MOST_FRAMES,
    WatchParameters,
    run_times,
)

times = st.floats(0.01, 20.0)


@given(times, times, times, times, times, times)
def test_never_more_than_the_mission_gives_and_always_room_for_one_more_detection(
    view_s: float, settling_s: float, blind_s: float, frame_s: float, detect_s: float, given_s: float
) -> None:
    found = useful_run_times(
        view_s=view_s, settling_s=settling_s, blind_s=blind_s, frame_s=frame_s, detect_s=detect_s, given_s=given_s
    )
    assert 0 < found.shortest_s <= found.longest_s <= given_s + 1e-3
    assert found.maximum_s >= found.longest_s + detect_s - 1e-3


@given(times, times, times)
def test_slices_are_short_only_where_short_ones_pay(settling_s: float, blind_s: float, detect_s: float) -> None:
    pays_s = settling_s + blind_s + detect_s
    for view_s, short in ((0.99 * pays_s, False), (1.01 * pays_s, True)):
        found = useful_run_times(
            view_s=view_s, settling_s=settling_s, blind_s=blind_s, frame_s=0.1, detect_s=detect_s, given_s=1000.0
        )
        assert (found.longest_s < 1000.0) is short
        assert (found.shortest_s < found.longest_s) is short


@given(st.integers())
def test_drawn_times_are_spread_between_the_shortest_and_the_longest(seed: int) -> None:
    dice = Random(seed)
    drawn = [RunTimes(0.7, 0.9, 2.0).drawn_s(dice) for _ in range(100)]
    assert 0.7 <= min(drawn) < 0.75
    assert 0.85 < max(drawn) <= 0.9


def test_nothing_is_drawn_where_there_is_no_choice() -> None:
    dice, untouched = Random(1), Random(1)
    assert RunTimes(5.0, 5.0, 6.0).drawn_s(dice) == 5.0
    assert dice.random() == untouched.random()


@pytest.mark.parametrize("wrong", [-1.0, math.nan, math.inf])
def test_times_that_are_none_are_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="no run times"):
        useful_run_times(view_s=wrong, settling_s=0.3, blind_s=0.5, frame_s=0.1, detect_s=0.8, given_s=5.0)


@pytest.mark.parametrize(
    "wild",
    [
        {"view_s": 1e17},
        {"settling_s": 1e17},
        {"frame_rate_hz": 1e-10},
        {"clean_share": 1e-10},
        {"frames_wanted": 10**9},
    ],
    ids=str,
)
def test_numbers_that_no_camera_and_no_target_has_are_refused(wild: dict[str, float]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"view_s": 5.0, **wild}, WatchParameters)


def test_the_longest_run_time_is_one_that_an_arc_accepts() -> None:
    slowest = WatchParameters(view_s=1.0, frame_rate_hz=LEAST_HZ, clean_share=LEAST_CLEAN, frames_wanted=MOST_FRAMES)
    assert run_times(slowest, A_DAY_S).maximum_s == A_DAY_S
