"""Tracks the landmark from picture to picture by the 17 pixels of its skeleton.

Acquiring → (found) → tracking → (no match) → searching → (found) → tracking, or → (best model below
70 %) → acquiring. Tracking correlates only the skeleton, around the last sighting. Searching compares the whole
subimage with the whole picture, which is slower; meanwhile the robot must stand still, so that the target keeps its
size. The search lasts longer than a burst of bad pictures.

Source: RAM 2002, "Visual Servoing" and figure 7.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from mission_control.vision.landmark import Disc, Floats, Picture, Sighting
from mission_control.vision.skeleton_model import (
    LEAST_DISCS,
    SKELETON_PIXELS,
    TargetModel,
    centred,
    is_match,
    plausible,
    skeleton_px,
)
from mission_control.vision.target_acquisition import acquire

REACH_COLUMNS_PX = 16  # measured: 0.9 rad/s moves the picture by 13 pixels from frame to frame
REACH_ROWS_PX = 20  # measured: the pitch of a starting or stopping body moves the picture by up to 18
SEARCH_FRAMES = 8  # chosen: 0.27 s, longer than nearly every burst of bad pictures (0.15 s on average)
STEADY_PX, STEADY_SHARE = 0.5, 0.05  # chosen: of the pitch; twice the noise plus the growth during an approach


class TrackingPhase(StrEnum):
    """Phases of the tracker."""

    ACQUIRING = "acquiring"
    TRACKING = "tracking"
    SEARCHING = "searching"


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The result of one picture.

    Attributes:
        phase: ``TRACKING``: the target was found. ``SEARCHING``: not found; stop and keep the camera still.
            ``ACQUIRING``: there is no valid model.
        sighting: Place of the target; None unless ``TRACKING``.
        match: Share of the target that agreed with the best model, 0 to 1.
    """

    phase: TrackingPhase
    sighting: Sighting | None
    match: float


class TargetTracker:
    """Tracks the target in one camera's pictures, one after the other; begins with acquisition."""

    def __init__(self) -> None:
        self.model: TargetModel | None = None
        """Subimage and skeleton of the last sighting, for debug views."""
        self._frames_left = 0

    def look(self, frame: Picture) -> Track:
        """Return the result of the next picture.

        Args:
            frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

        Raises:
            ValueError: The array is not a grey picture.
        """
        if frame.ndim != 2 or frame.dtype != np.uint8:
            raise ValueError(f"a grey picture has shape (height, width) and bytes, not {frame.shape} of {frame.dtype}")
        if self.model is None:
            return self._acquire(frame)
        sighting = track_skeleton(frame, self.model)
        if sighting is not None:
            return self._found(frame, self.model, sighting)
        # Only now, because the whole picture costs many times as much as the skeleton.
        match, sighting = search_subimage(frame, self.model)
        if sighting is not None:
            return self._found(frame, self.model, sighting)
        self._frames_left -= 1
        if self._frames_left > 0:
            return Track(TrackingPhase.SEARCHING, None, match)
        self.forget()
        return Track(TrackingPhase.ACQUIRING, None, match)

    def forget(self) -> None:
        """Begin again with acquisition, because the robot may have been moved."""
        self.model = None

    def _acquire(self, frame: Picture) -> Track:
        sighting = acquire(frame)
        if sighting is None:
            return Track(TrackingPhase.ACQUIRING, None, 0.0)
        self.model = TargetModel.seen(frame, sighting.blobs_px)
        self._frames_left = SEARCH_FRAMES
        return Track(TrackingPhase.TRACKING, sighting, sighting.match)

    def _found(self, frame: Picture, model: TargetModel, sighting: Sighting) -> Track:
        self.model = model.updated(frame, sighting.blobs_px)
        self._frames_left = SEARCH_FRAMES
        return Track(TrackingPhase.TRACKING, sighting, sighting.match)


def track_skeleton(frame: Picture, model: TargetModel) -> Sighting | None:
    """Return the target near the model's place; None if less than 70 % of the skeleton matches there.

    Args:
        frame: Grey levels 0 to 255, shape (height, width).
        model: Model of the last sighting.
    """
    shift_px = best_shift_px(frame, model)
    return None if shift_px is None else _placed(frame, model, model.blobs_px + shift_px)


def search_subimage(frame: Picture, model: TargetModel) -> tuple[float, Sighting | None]:
    """Return the best match of the subimage in the whole picture, and the target there.

    Args:
        frame: Grey levels 0 to 255, shape (height, width).
        model: The last valid model.

    Returns:
        The subimage's match, -1 to 1; and the sighting, None if this match or that of the skeleton is below 70 %.
    """
    match, shift_px = model.best_subimage_match(frame)
    return match, _placed(frame, model, model.blobs_px + np.array(shift_px, float)) if is_match(match) else None


def best_shift_px(frame: Picture, model: TargetModel) -> Floats | None:
    """Return the skeleton's shift in columns and rows; None if it matches nowhere within reach.

    Method: the 17 pixels are correlated with every place at most ``REACH_COLUMNS_PX`` and ``REACH_ROWS_PX`` away. If
    many places match equally, the result is the place nearest to their middle.
    """
    middle = int(model.middle_level)
    is_bright = (model.levels > middle).astype(np.uint8).tolist()
    height, width = frame.shape
    size = (2 * REACH_ROWS_PX + 1, 2 * REACH_COLUMNS_PX + 1)
    discs, gaps = np.zeros(size, np.uint8), np.zeros(size, np.uint8)
    binary = cv2.threshold(frame, middle, 1, cv2.THRESH_BINARY)[1]
    for number, (column, row) in enumerate(skeleton_px(model.blobs_px).tolist()):
        left, top = column - REACH_COLUMNS_PX, row - REACH_ROWS_PX
        columns = slice(max(0, left), min(width, left + size[1]))
        rows = slice(max(0, top), min(height, top + size[0]))
        if columns.start >= columns.stop or rows.start >= rows.stop:
            continue
        there = (slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left))
        agrees = binary[rows, columns] == is_bright[number]
        (discs if number < len(Disc) else gaps)[there] += agrees
    score = np.where(discs >= LEAST_DISCS, discs + gaps, 0)
    best = int(score.max())
    if not is_match(best / SKELETON_PIXELS):
        return None
    found_rows, found_columns = np.nonzero(score == best)
    off_px = (found_rows - found_rows.mean()) ** 2 + (found_columns - found_columns.mean()) ** 2
    nearest = int(np.argmin(off_px))
    return np.array([found_columns[nearest] - REACH_COLUMNS_PX, found_rows[nearest] - REACH_ROWS_PX], float)


def _placed(frame: Picture, model: TargetModel, blobs_px: Floats) -> Sighting | None:
    """Return the sighting with its discs centred; None if skeleton or subimage matches too little there.

    Among 1300 places, a bad picture often has one at which twelve pixels fit by chance; the subimage does not fit
    there.
    """
    placed = steadied(centred(frame, blobs_px, model.middle_level), blobs_px)
    if not plausible(placed):
        return None
    match = min(model.match(frame, placed), model.subimage_match(frame, placed))
    return Sighting(placed, match) if is_match(match) else None


def steadied(placed_px: Floats, expected_px: Floats) -> Floats:
    """Return the blobs at their apparent places, limited to the possible change of the target's shape.

    A torn row displaces single discs, while the target's shape changes little from picture to picture. An initially
    wrong shape is corrected within a few pictures.

    Args:
        placed_px: Apparent places of the discs, as ``Sighting.blobs_px``.
        expected_px: The expected shape, approximately at this place.
    """
    moved_px = placed_px - expected_px
    # The median of four; numpy's own takes as long as the whole correlation.
    usual_px = np.sort(moved_px, axis=0)[1:3].mean(axis=0)
    slack_px = STEADY_PX + STEADY_SHARE * float(expected_px[Disc.STEM, 1] - expected_px[Disc.MIDDLE, 1])
    return np.asarray(expected_px + usual_px + np.clip(moved_px - usual_px, -slack_px, slack_px))
