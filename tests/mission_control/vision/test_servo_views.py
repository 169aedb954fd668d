"""What the tracker goes by, drawn: a view never changes the picture, and marks what the tracker counts."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from landmark_pictures import polar, view

from mission_control.vision.servo_views import CANDIDATE, MATCHED, MISSED, blobs_view, mark, skeleton_view
from mission_control.vision.skeleton_model import SKELETON_PIXELS
from mission_control.vision.skeleton_tracking import TargetTracker


def count(drawn: np.ndarray, color: tuple[int, int, int]) -> int:
    return int((drawn == color).all(axis=2).sum())


def test_the_skeleton_is_green_where_it_matches_and_red_where_it_does_not() -> None:
    picture, tracker = view(*polar(1.0, 0.0)), TargetTracker()
    before = picture.copy()
    assert tracker.look(picture).sighting is not None
    assert tracker.model is not None
    pixels, agrees = tracker.model.agreement(picture, tracker.model.blobs_px)
    assert agrees.all()
    drawn = skeleton_view(picture, tracker.model)
    assert count(drawn, MATCHED) >= SKELETON_PIXELS
    assert count(drawn, MISSED) == 0
    assert all(tuple(drawn[row, column]) == MATCHED for column, row in pixels.tolist())
    elsewhere = skeleton_view(np.full_like(picture, 200), tracker.model)
    assert count(elsewhere, MISSED) > 0
    assert (picture == before).all()


def test_without_a_target_the_views_show_the_picture_and_what_could_be_discs() -> None:
    picture, tracker = view(*polar(1.0, 0.0)), TargetTracker()
    assert (skeleton_view(picture, None) == picture[:, :, np.newaxis]).all()
    assert count(blobs_view(picture, None), CANDIDATE) > 0
    sighting = tracker.look(picture).sighting
    assert sighting is not None
    assert count(blobs_view(picture, sighting.blobs_px), MATCHED) > 0


@given(st.integers(-9, 20), st.integers(-9, 20))
def test_a_mark_stays_in_the_picture_and_within_its_arms(column: int, row: int) -> None:
    drawn = np.zeros((10, 12, 3), np.uint8)
    mark(drawn, column, row, MATCHED)
    rows, columns = np.nonzero((drawn == MATCHED).all(axis=2))
    assert all(abs(at - row) + abs(to - column) <= 2 for at, to in zip(rows, columns, strict=True))
    assert (len(rows) == 9) == (2 <= row <= 7 and 2 <= column <= 9)
