"""Laws of the air: distance weakens, fading is Rayleigh's, and all of it is a function of seed and time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from scout_model.air import (
    FADE_S,
    FADED_SHARE,
    NEAREST_M,
    REFERENCE_M,
    Fading,
    antenna_m,
    counted_distance_m,
    distance_m,
    fade_level,
    key_of,
    snr_db,
    words_of,
)
from scout_model.description import AirDescription

RATE_HZ = 60
metres = st.floats(NEAREST_M, 500)


@pytest.fixture(scope="module")
def courses() -> NDArray[np.float64]:
    """Return the power during one minute, for each of eight seeds."""
    fadings = [Fading((seed, 1)) for seed in range(8)]
    return np.array([[fading.power(sample / RATE_HZ) for sample in range(60 * RATE_HZ)] for fading in fadings])


@given(metres, metres)
def test_the_farther_the_weaker_and_the_more_often_faded(one_m: float, other_m: float) -> None:
    near_m, far_m = sorted((one_m, other_m))
    assert snr_db(near_m) >= snr_db(far_m)
    assert fade_level(near_m) <= fade_level(far_m)


@given(metres, st.floats(0, 10))
def test_at_the_reference_distance_the_weight_of_distance_plays_no_part(away_m: float, weight: float) -> None:
    assert counted_distance_m(REFERENCE_M, weight) == pytest.approx(REFERENCE_M)
    assert counted_distance_m(away_m, 0.0) == pytest.approx(REFERENCE_M)
    assert counted_distance_m(away_m, 1.0) == pytest.approx(away_m)


def test_power_is_one_on_average_and_exponentially_distributed_as_rayleighs(courses: NDArray[np.float64]) -> None:
    assert courses.mean() == pytest.approx(1.0, abs=0.05)
    for level in (0.1, 0.288, 1.0, 2.0):
        assert (level > courses).mean() == pytest.approx(1.0 - math.exp(-level), abs=0.03)


def test_at_the_reference_distance_a_quarter_of_the_time_is_faded_for_a_seventh_of_a_second_each(
    courses: NDArray[np.float64],
) -> None:
    faded = fade_level(REFERENCE_M) > courses
    begun = np.count_nonzero(np.diff(faded.astype(int), axis=1) == 1)
    assert faded.mean() == pytest.approx(FADED_SHARE, abs=0.03)
    assert faded.sum() / begun / RATE_HZ == pytest.approx(FADE_S, rel=0.15)


@given(st.floats(0, 1e6), st.integers(0, 2**32))
def test_power_at_a_time_is_the_same_whatever_was_asked_before(time_s: float, seed: int) -> None:
    asked, fresh = Fading((seed, 3)), Fading((seed, 3))
    for other_s in (0.0, 1e5, time_s / 2):
        asked.power(other_s)
    assert asked.power(time_s) == fresh.power(time_s) >= 0.0


def test_the_antenna_stands_in_the_middle_of_the_room_unless_it_is_said_where() -> None:
    assert antenna_m(AirDescription(), 9.0, 6.0) == (4.5, 3.0, 1.0)
    assert antenna_m(AirDescription(antenna_x_m=0.0, antenna_y_m=-1.0, antenna_z_m=2.0), 9.0, 6.0) == (0.0, -1.0, 2.0)


def test_a_robot_at_the_antenna_has_a_distance() -> None:
    assert distance_m((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)) == NEAREST_M
    assert distance_m((0.0, 3.0, 1.0), (4.0, 0.0, 1.0)) == 5.0


def test_names_have_the_same_number_in_every_process() -> None:
    assert key_of("video1") == 0xB178448E
    assert key_of("video1") != key_of("video2")


@given(st.lists(st.integers(0, 2**70), min_size=1, max_size=5))
def test_from_the_words_of_a_seed_numpy_draws_what_it_draws_from_its_numbers(numbers: list[int]) -> None:
    words = np.array([word for number in numbers for word in words_of(number)], np.uint32)
    assert np.random.default_rng(words).random() == np.random.default_rng(numbers).random()
