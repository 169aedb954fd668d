"""Pictures fall first where a processor is full, rise again, and never swing."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from resource_pool.drivers.picture_pace import CALM_MOST, LATE_S, LEAST_HZ, WINDOW_S, PicturePace

IN_TIME_S, TOO_LATE_S = 0.001, 2 * LATE_S


def drawn(
    pace: PicturePace, seconds: float, late_s: Callable[[float, int], float], since_s: float = 0.0
) -> list[float]:
    """Draw for so long at the allowed rate; return the allowed rate after each picture."""
    rates, now_s, number = [], since_s, 0
    while now_s < since_s + seconds:
        number += 1
        pace.delivered(late_s(pace.allowed_hz, number), now_s)
        rates.append(pace.allowed_hz)
        now_s += 1 / pace.allowed_hz
    return rates


def always(late_s: float) -> Callable[[float, int], float]:
    return lambda _hz, _number: late_s


@given(
    st.floats(0.1, 30.0),
    st.lists(st.tuples(st.floats(0.0, 0.1), st.floats(0.0, 5.0)), max_size=200),
)
def test_the_rate_never_leaves_what_is_asked_for_and_never_ends(
    asked_hz: float, pictures: list[tuple[float, float]]
) -> None:
    pace, now_s = PicturePace(asked_hz), 0.0
    for late_s, pause_s in pictures:
        before, now_s = pace.allowed_hz, now_s + pause_s
        assert pace.delivered(late_s, now_s) == (pace.allowed_hz != before)
        assert min(asked_hz, LEAST_HZ) <= pace.allowed_hz <= asked_hz
        assert bool(pace.remark()) == (pace.allowed_hz < asked_hz)


@given(st.floats(1.5, 30.0))
def test_where_all_is_late_it_falls_to_the_least_and_comes_back_when_all_is_calm(asked_hz: float) -> None:
    pace = PicturePace(asked_hz)
    falling = drawn(pace, 30.0, always(TOO_LATE_S))
    assert falling == sorted(falling, reverse=True)
    assert falling[-1] == LEAST_HZ
    rising = drawn(pace, 120.0, always(IN_TIME_S), since_s=100.0)
    assert rising == sorted(rising)
    assert rising[-1] == asked_hz


def test_a_full_processor_costs_a_third_of_the_pictures_within_one_window() -> None:
    pace = PicturePace(15.0)
    drawn(pace, WINDOW_S + 0.2, always(TOO_LATE_S))
    assert pace.allowed_hz == 10.0
    assert pace.remark() == "10 of 15 pictures a second: control goes first on a full processor"


def test_one_late_picture_now_and_then_changes_nothing() -> None:
    rates = drawn(PicturePace(15.0), 300.0, lambda _hz, number: TOO_LATE_S if number % 100 == 0 else IN_TIME_S)
    assert set(rates) == {15.0}


def test_where_more_was_too_much_it_tries_again_seldom() -> None:
    pace = PicturePace(15.0)
    rates = drawn(pace, 600.0, lambda hz, number: TOO_LATE_S if hz > 8 and number % 5 == 0 else IN_TIME_S)
    settled = rates[len(rates) // 4 :]
    assert 5.0 < min(settled) <= max(settled) < 11.0
    changes = sum(one != other for one, other in pairwise(settled))
    assert changes <= 4 * 450.0 / WINDOW_S / CALM_MOST  # one fall and three rises each time


def test_time_without_pictures_is_neither_calm_nor_late() -> None:
    pace = PicturePace(15.0)
    drawn(pace, WINDOW_S + 0.2, always(TOO_LATE_S))
    assert not any(pace.delivered(IN_TIME_S, 1000.0 * hold) for hold in range(1, 20))
    assert pace.allowed_hz == 10.0


def test_another_asked_rate_holds_at_once_unless_the_processor_is_full() -> None:
    pace = PicturePace(15.0)
    pace.ask(30.0)
    assert pace.allowed_hz == 30.0
    drawn(pace, WINDOW_S + 0.2, always(TOO_LATE_S))
    pace.ask(25.0)
    assert (pace.asked_hz, pace.allowed_hz) == (25.0, 20.0)
    pace.ask(5.0)
    assert pace.allowed_hz == 5.0
