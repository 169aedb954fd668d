"""When a unit runs: laws of the grid of ticks and of the inputs that are waited for."""

from __future__ import annotations

import math

import msgspec
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from mission_control.modules.unit_schedule import MOST_HZ, OnInput, Trigger, UnitSchedule

frequencies = st.one_of(st.floats(0.01, MOST_HZ), st.sampled_from([1.0, 3.0, 7.0, 10.0, 30.0, 1000.0]))


@given(frequencies, st.floats(0.0, 1e6), st.lists(st.floats(0.0, 5.0), max_size=30))
@settings(max_examples=share(400))
def test_ticks_stay_on_their_grid_and_each_one_is_run_or_missed(
    frequency_hz: float, start_s: float, pauses_s: list[float]
) -> None:
    schedule, now_s = UnitSchedule(Trigger(frequency_hz), (), start_s), start_s
    for pause_s in pauses_s:
        now_s += pause_s
        due_s = schedule.due_s
        before = schedule.ticks + schedule.missed
        assert schedule.tick(now_s) == (now_s >= due_s)
        number = schedule.ticks + schedule.missed
        assert schedule.due_s == start_s + number / frequency_hz
        assert schedule.due_s > now_s
        if number > before:
            assert start_s + (number - 1) / frequency_hz <= now_s, "a tick was missed before its time"
    assert 0.0 <= schedule.most_late_s <= schedule.late_s


@given(frequencies, st.integers(1, 200))
def test_who_is_always_on_time_misses_nothing_and_has_the_rate_that_was_asked_for(
    frequency_hz: float, rounds: int
) -> None:
    schedule = UnitSchedule(Trigger(frequency_hz), (), 5.0)
    for _ in range(rounds):
        now_s = schedule.due_s
        assert schedule.tick(now_s)
        schedule.began(now_s)
    assert (schedule.missed, schedule.most_late_s, schedule.ticks) == (0, 0.0, rounds)
    for late in (0.0, 1.0, 2.0):
        rate_hz = schedule.rate_hz(now_s + late / frequency_hz)
        assert rounds == 1 or math.isclose(rate_hz, frequency_hz, rel_tol=1e-6)


def test_the_rate_of_a_unit_that_stands_still_falls() -> None:
    schedule = UnitSchedule(Trigger(), ("picture",), 0.0)
    for number in range(300):
        schedule.began(number / 30.0)
    assert math.isclose(schedule.rate_hz(10.0), 30.0)
    rates = [schedule.rate_hz(10.0 + seconds) for seconds in range(3600)]
    assert rates == sorted(rates, reverse=True)
    assert rates[-1] < 0.02


@given(st.sets(st.sampled_from("abc")), st.lists(st.sampled_from("abcd"), max_size=40))
@settings(max_examples=share(200))
def test_all_means_that_each_has_come_since_all_had(awaited: set[str], comes: list[str]) -> None:
    schedule, since = UnitSchedule(Trigger(on_input=OnInput.ALL), awaited, 0.0), list[str]()
    for key in comes:
        since.append(key)
        is_due = schedule.arrived(key)
        assert is_due == (key in awaited and awaited <= set(since))
        since = [] if is_due else since


@given(st.sets(st.sampled_from("abc")), st.lists(st.sampled_from("abcd"), max_size=40))
def test_any_means_each_that_is_awaited_and_none_means_none(awaited: set[str], comes: list[str]) -> None:
    on_any = UnitSchedule(Trigger(), awaited, 0.0)
    on_none = UnitSchedule(Trigger(1.0, OnInput.NONE), awaited, 0.0)
    assert [on_any.arrived(key) for key in comes] == [key in awaited for key in comes]
    assert not any(on_none.arrived(key) for key in comes)
    assert on_any.due_s == math.inf
    assert not on_any.tick(1e9)


def test_a_late_round_names_what_it_missed_and_delays_no_later_one() -> None:
    schedule = UnitSchedule(Trigger(10.0), (), 0.0)
    assert schedule.tick(0.0)
    assert schedule.tick(0.35)
    assert (schedule.missed, schedule.due_s) == (2, 0.4)
    assert math.isclose(schedule.most_late_s, 0.25)


def test_a_unit_that_could_never_run_is_refused() -> None:
    with pytest.raises(ValueError, match="never runs"):
        Trigger(0.0, OnInput.NONE)
    with pytest.raises(msgspec.ValidationError, match="never runs"):
        msgspec.convert({"on_input": "none"}, Trigger)


@pytest.mark.parametrize("frequency_hz", [-1.0, math.nan, math.inf, 2 * MOST_HZ])
def test_a_frequency_without_a_grid_is_refused_wherever_it_comes_from(frequency_hz: float) -> None:
    """A script gives it to ``run``, and nothing decodes it: -1 Hz never ended, and with nan no round began."""
    with pytest.raises(ValueError, match=f"a frequency of {frequency_hz} Hz; give one from 0 to 1000"):
        Trigger(frequency_hz)
