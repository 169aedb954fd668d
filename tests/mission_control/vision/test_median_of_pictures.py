"""The median of a few pictures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_control.vision.motion_detection import median_of


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_it_is_the_median_of_each_pixel(count: int, seed: int) -> None:
    pictures = [*np.random.default_rng(seed).integers(0, 256, (count, 3, 5)).astype(np.float32)]
    found = median_of(pictures)
    assert found.dtype == np.float32
    assert np.array_equal(found, np.median(pictures, axis=0))


def test_of_no_picture_there_is_none() -> None:
    with pytest.raises(ValueError, match="no picture"):
        median_of([])
