"""The earlier method: good against white noise, helpless against whole rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as np_st

from mission_control.vision.frame_averaging import AVERAGED, FrameAveraging, average


def grey(level: int = 120) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    return np.full((240, 320), level, np.uint8)


@given(st.lists(np_st.arrays(np.uint8, (4, 5)), min_size=1, max_size=6))
def test_an_average_lies_between_the_darkest_and_the_brightest(frames: list[np.ndarray]) -> None:
    mean = average(frames)
    assert (mean >= np.min(frames, axis=0)).all()
    assert (mean <= np.max(frames, axis=0)).all()


@given(st.lists(np_st.arrays(np.uint8, (4, 5)), min_size=1, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_pictures_does_not_matter(frames: list[np.ndarray], rng: np.random.Generator) -> None:
    mixed = list(frames)
    rng.shuffle(mixed)
    assert np.array_equal(average(mixed), average(frames))


def test_white_noise_shrinks_with_the_root_of_the_number() -> None:
    rng = np.random.default_rng(0)
    frames = [np.clip(rng.normal(128, 20, (240, 320)), 0, 255).astype(np.uint8) for _ in range(16)]
    assert float(average(frames).std()) == pytest.approx(5.0, rel=0.1)


def test_a_thin_line_in_one_picture_is_averaged_away_and_a_torn_picture_is_not() -> None:
    detector, lined, torn = FrameAveraging(), grey(), grey()
    lined[100:102] = 200
    torn[120:] = 255
    still = [grey()] * (2 * AVERAGED)
    assert not any(detector.look(frame) for frame in [*still, lined, *still])
    assert any(detector.look(frame) for frame in [torn, *still])


def test_a_body_that_crosses_the_view_is_found() -> None:
    detector, found = FrameAveraging(), []
    for number in range(30):
        frame = grey()
        frame[80:140, 10 * number : 10 * number + 40] = 230
        found.append(detector.look(frame))
    assert not any(found[: 2 * AVERAGED - 1])
    assert all(found[2 * AVERAGED - 1 :])


def test_another_view_after_a_swap_is_no_motion() -> None:
    detector = FrameAveraging()
    for _ in range(10):
        detector.look(grey(100))
    detector.swapped_in()
    assert not any(detector.look(grey(200)) for _ in range(10))


def test_pictures_that_have_no_average_are_refused() -> None:
    with pytest.raises(ValueError, match="no picture"):
        average([])
    with pytest.raises(ValueError, match="shapes"):
        average([grey(), grey()[:100]])
    with pytest.raises(ValueError, match="1 or more"):
        FrameAveraging(0)
    with pytest.raises(ValueError, match="grey"):
        FrameAveraging().look(np.zeros((2, 2, 3), np.uint8))
