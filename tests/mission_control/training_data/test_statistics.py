"""Statistics of grey levels are those of the pixels, without keeping the pixels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_control.training_data.statistics import LEVELS, of_levels, of_numbers


@given(pixels=st.lists(st.integers(0, 255), min_size=1, max_size=60))
def test_statistics_of_levels_are_those_of_the_pixels(pixels: list[int]) -> None:
    found = of_levels(np.bincount(pixels, minlength=LEVELS), 3)
    shares = np.array(pixels) / 255
    assert found.pop("count") == [3]
    assert all(np.shape(value) == (3, 1, 1) and len({*np.ravel(value)}) == 1 for value in found.values())
    one = {name: float(np.ravel(value)[0]) for name, value in found.items()}
    expected = {"min": shares.min(), "max": shares.max(), "mean": shares.mean(), "std": shares.std()}
    assert {name: one[name] for name in expected} == pytest.approx(expected, abs=1e-9)
    for percent in (1, 10, 50, 90, 99):
        assert one[f"q{percent:02d}"] == np.quantile(shares, percent / 100, method="inverted_cdf")


def test_statistics_of_numbers_are_by_column() -> None:
    found = of_numbers(np.array([[0.0, 5.0], [2.0, 5.0]]))
    assert (found["min"], found["max"], found["q50"], found["count"]) == ([0.0, 5.0], [2.0, 5.0], [1.0, 5.0], [2])
