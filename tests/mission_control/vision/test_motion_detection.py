"""Laws of motion detection: noise is no motion, a moving body is, a torn picture is nothing."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from mission_control.vision.motion_detection import (
    FAST_FRAMES,
    ROW_SHARE,
    Blob,
    MotionDetector,
    halve,
    largest_blob,
    noise_bar,
    torn_rows,
)

HEIGHT_PX, WIDTH_PX = 240, 320
Picture = NDArray[np.uint8]


def room(seed: int = 0) -> Picture:
    """A room of smooth shades and some edges."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(60, 180, (6, 8)).astype(np.uint8)
    return np.asarray(cv2.resize(coarse, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_CUBIC), np.uint8)


def noisy(picture: Picture, rng: np.random.Generator, sigma: float) -> Picture:
    return np.clip(picture + rng.normal(0.0, sigma, picture.shape), 0, 255).astype(np.uint8)


def with_block(picture: Picture, x_px: int, y_px: int = 100, side_px: int = 40, grey: int = 230) -> Picture:
    drawn = picture.copy()
    drawn[y_px : y_px + side_px, max(x_px, 0) : x_px + side_px] = grey
    return drawn


def look_at(pictures: list[Picture], detector: MotionDetector | None = None) -> list[Blob | None]:
    detector = detector or MotionDetector()
    return [detector.look(picture) for picture in pictures]


@settings(max_examples=share(6))
@given(seed=st.integers(0, 2**32 - 1), sigma=st.floats(0.0, 25.0))
def test_noise_alone_is_no_motion(seed: int, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    assert not any(look_at([noisy(room(seed), rng, sigma) for _ in range(60)]))


def test_a_scene_that_stands_still_is_no_motion() -> None:
    assert not any(look_at([room()] * 60))


@settings(max_examples=share(6))
@given(seed=st.integers(0, 1000), speed_px=st.integers(3, 12), sigma=st.floats(0.0, 10.0))
def test_a_block_that_crosses_the_view_is_found_where_it_is(seed: int, speed_px: int, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    still = [noisy(room(seed), rng, sigma) for _ in range(20)]
    crossing = [noisy(with_block(room(seed), x), rng, sigma) for x in range(0, WIDTH_PX - 40, speed_px)]
    detector = MotionDetector()
    assert not any(look_at(still, detector))
    found = look_at(crossing, detector)
    assert any(found)
    for number, blob in enumerate(found):
        if blob is not None:
            assert blob.x_px <= number * speed_px + 44
            assert 80 <= blob.y_px <= 150


@settings(max_examples=share(5))
@given(seed=st.integers(0, 1000), share=st.floats(0.3, 1.0))
def test_a_picture_torn_in_many_rows_is_rejected(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    detector = MotionDetector()
    look_at([room(seed)] * 20, detector)
    for _ in range(30):
        torn = room(seed).copy()
        rows = rng.random(HEIGHT_PX // 4).repeat(4) < share
        torn[rows] = np.where(torn[rows] > 127, 0, 255)
        assert detector.look(torn) is None
        for _ in range(4):
            assert detector.look(room(seed)) is None


@settings(max_examples=share(5))
@given(seed=st.integers(0, 1000))
def test_single_torn_rows_are_no_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    detector = MotionDetector()
    for _ in range(60):
        torn = noisy(room(seed), rng, 5.0)
        for row in rng.integers(0, HEIGHT_PX - 3, 4):
            torn[row : row + rng.integers(1, 4)] = rng.choice([0, 255])
        assert detector.look(torn) is None


def test_a_flash_of_one_picture_is_outvoted() -> None:
    detector = MotionDetector()
    pictures = [room()] * 20 + [with_block(room(), 100)] * 2 + [room()] * 20
    assert not any(look_at(pictures, detector))


def test_after_a_swap_a_changed_view_is_learned_without_an_alarm() -> None:
    """A robot that an operator drove meanwhile looks elsewhere; that is no motion."""
    detector = MotionDetector()
    look_at([room(1)] * 30, detector)
    detector.swapped_in()
    assert not any(look_at([room(2)] * 60, detector))


@pytest.mark.parametrize("stood_frames", [5, 15, 40])
def test_who_left_or_came_while_the_robot_was_away_does_not_move_now(stood_frames: int) -> None:
    """What the slice before ended with may be gone, what was not there may stand there: neither is an alarm."""
    detector = MotionDetector()
    look_at([room()] * 30 + [with_block(room(), 120)] * stood_frames, detector)
    for now in (room(), with_block(room(), 200)):
        detector.swapped_in()
        assert not any(look_at([now] * 40, detector))


def test_the_view_is_remembered_over_a_swap() -> None:
    """What moves right after the swap is found as soon as the fast frames are over."""
    detector = MotionDetector()
    look_at([room()] * 30, detector)
    detector.swapped_in()
    found = look_at([with_block(room(), 10 * number) for number in range(20)], detector)
    assert not any(found[:FAST_FRAMES])
    assert any(found[FAST_FRAMES : FAST_FRAMES + 4])


def test_a_picture_of_another_size_starts_afresh() -> None:
    detector = MotionDetector()
    look_at([room()] * 30, detector)
    assert detector.look(np.full((120, 160), 200, np.uint8)) is None


def test_only_grey_pictures_are_looked_at() -> None:
    with pytest.raises(ValueError, match="grey"):
        MotionDetector().look(np.zeros((4, 4, 3), np.uint8))


@settings(max_examples=share(20))
@given(
    rows=st.sets(st.integers(0, 49), max_size=12),
    columns=st.integers(0, 40),
    width_px=st.integers(1, 27),
    seed=st.integers(0, 99),
)
def test_the_row_filter_never_lets_a_whole_row_pass(rows: set[int], columns: int, width_px: int, seed: int) -> None:
    """RAM 2002: any blob that looks like whole rows of pixels is filtered out."""
    picture = room(seed)
    detector = MotionDetector()
    look_at([picture] * 20, detector)
    spoiled = with_block(picture, 4 * columns, side_px=width_px)
    for row in rows:
        spoiled[4 * row : 4 * row + 4] = np.where(spoiled[4 * row : 4 * row + 4] > 127, 0, 255)
    detector.look(spoiled)
    stages = detector.stages
    assert stages is not None
    assert not (stages.kept & ~stages.changed).any()
    assert stages.kept.mean(axis=1).max() <= ROW_SHARE
    assert not stages.kept[torn_rows(stages.changed)].any()


def test_without_the_row_filter_partial_pictures_are_motion_and_with_it_they_are_not() -> None:
    rng = np.random.default_rng(0)
    pictures = [room()] * 20
    for _ in range(40):
        partial = room().copy()
        partial[int(rng.integers(205, 225)) :] = 0
        pictures += [partial, partial, room()]
    assert any(look_at(pictures, MotionDetector(filters_rows=False)))
    assert not any(look_at(pictures))


def test_the_stages_of_a_judgment_can_be_looked_at() -> None:
    detector = MotionDetector()
    detector.look(room())
    assert detector.stages is None
    look_at([room()] * 20, detector)
    blob = None
    for _ in range(3):
        blob = detector.look(with_block(room(), 100))
    stages = detector.stages
    assert blob is not None
    assert stages is not None
    assert stages.picture.shape == stages.average.shape == stages.changed.shape == (HEIGHT_PX // 2, WIDTH_PX // 2)
    assert stages.kept[55:65, 55:65].all()


def test_halving_takes_the_mean_of_four() -> None:
    picture = np.array([[0, 100, 8, 8], [100, 200, 8, 8]], np.uint8)
    assert halve(picture).tolist() == [[100, 8]]


def test_the_bar_rises_with_the_mean_difference() -> None:
    assert noise_bar(np.full((10, 10), 60.0, np.float32)) > 60.0
    one = np.zeros((10, 10), np.float32)
    one[3, 3] = 60.0
    assert noise_bar(one) < 60.0


def test_a_streak_is_no_body() -> None:
    changed = np.zeros((50, 50), np.bool_)
    changed[10:13, 5:45] = True
    assert not torn_rows(changed[:, :10]).all()
    assert largest_blob(changed) is None
    changed[20:30, 20:28] = True
    assert largest_blob(changed) == Blob(40, 40, 16, 20, 320)


@pytest.mark.parametrize("shape", [(2, 2), (3, 3), (240, 2), (2, 320)])
def test_the_smallest_pictures_are_judged_too(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    assert not any(look_at([rng.integers(0, 256, shape, np.uint8) for _ in range(30)]))


@pytest.mark.parametrize("first", [1, FAST_FRAMES - 1, FAST_FRAMES, FAST_FRAMES + 3])
def test_a_new_shape_begins_anew_also_among_the_first_pictures(first: int) -> None:
    detector = MotionDetector()
    look_at([room()] * first, detector)
    lower = [room()[: HEIGHT_PX // 2]] * 30
    assert not any(look_at(lower, detector))
    assert any(look_at([with_block(lower[0], x, y_px=40) for x in range(0, 200, 10)], detector))


@settings(max_examples=share(50))
@given(
    changed=arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 12))),
    whole=st.sets(st.integers(0, 5)),
)
def test_a_row_is_torn_if_more_than_a_share_of_it_changed(changed: NDArray[np.bool_], whole: set[int]) -> None:
    changed[[row for row in whole if row < len(changed)]] = True
    assert torn_rows(changed).tolist() == [bool(row.mean() > ROW_SHARE) for row in changed]
