import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model.description import Target
from scout_model.targets import path_length_m, where

PATH = [(0.0, 3.0), (4.0, 3.0), (4.0, 3.0), (4.0, 0.0)]


def walker(*, there_and_back: bool = True, rest_s: float = 1.0) -> Target:
    return Target("t", "pioneer", PATH, speed_m_s=0.5, begin_s=2.0, rest_s=rest_s, there_and_back=there_and_back)


@given(st.floats(0, 1000), st.floats(0, 0.2), st.booleans())
def test_it_never_moves_faster_than_its_speed_along_the_path(time_s: float, later_s: float, rests: bool) -> None:
    target = walker(rest_s=1.0 if rests else 0.0)
    here, there = where(target, time_s), where(target, time_s + later_s)
    assert math.dist((here.x_m, here.y_m), (there.x_m, there.y_m)) <= target.speed_m_s * later_s + 1e-6


def test_it_stands_at_its_beginning_until_it_departs() -> None:
    assert [(where(walker(), t).x_m, where(walker(), t).y_m) for t in (0.0, 2.0)] == [(0.0, 3.0)] * 2


def test_it_turns_the_corner_rests_at_the_end_and_returns() -> None:
    target = walker()
    assert path_length_m(target.path) == 7.0
    corner, end, resting, returning = (where(target, t) for t in (15.0, 16.0, 16.9, 19.0))
    assert (corner.x_m, corner.y_m) == pytest.approx((4.0, 0.5))
    assert corner.heading_rad == pytest.approx(-math.pi / 2)
    assert (end.x_m, end.y_m) == (resting.x_m, resting.y_m) == (4.0, 0.0)
    assert (returning.x_m, returning.y_m) == pytest.approx((4.0, 1.0))
    assert returning.heading_rad == pytest.approx(math.pi / 2)


def test_without_a_way_back_it_begins_again() -> None:
    again = where(walker(there_and_back=False), 2.0 + 15.0 + 1.0)
    assert (again.x_m, again.y_m) == pytest.approx((0.5, 3.0))
