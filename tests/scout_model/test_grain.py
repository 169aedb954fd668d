"""Noise is added as arithmetic says, however strong it is."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scout_model.grain import Grain, Picture

SHAPE = (7, 33)


@given(
    picture=arrays(np.uint8, SHAPE),
    levels=arrays(np.float64, SHAPE, elements=st.floats(-1000, 1000)),
    factor=st.floats(0.01, 100),
)
def test_a_picture_with_grain_is_their_sum_within_its_range(
    picture: Picture, levels: np.ndarray, factor: float
) -> None:
    before = picture.copy()
    summed = np.clip(picture.astype(int) + np.rint(levels * factor).astype(int), 0, 255)
    assert np.array_equal(Grain.of(levels, factor).on(picture), summed)
    assert np.array_equal(picture, before)
