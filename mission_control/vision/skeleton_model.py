"""The two models of a seen landmark: the subimage of the target, and its skeleton of 17 pixels.

The skeleton consists of the middle of each disc and the points half a pitch above, left, right and below it; these lie
on the white around the disc. That makes 4 + 16 points. A point between two neighbouring discs belongs to both and
counts once. A T has three such pairs, so 17 points remain.

Acquisition, tracking and search use the same rule. A pixel of the skeleton agrees if it is on the same side of the
middle between black and white as in its model; a pixel outside the picture never agrees. At least 70 % must agree, and
the subimage must correlate with the picture by at least 0.7.

Source: RAM 2002, "Visual Servoing" and figure 7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mission_control.vision.landmark import Disc, Floats, Picture, Sighting

SKELETON_PIXELS = 17  # RAM 2002, "Visual Servoing": the skeleton for a four-blob target
LEAST_MATCH = 0.70  # RAM 2002, "Visual Servoing": below it, acquisition begins again
LEAST_CONTRAST = 55.0  # measured: grey levels between gaps and discs; with less, shades of a floor are accepted
LEAST_DISCS = 3  # chosen: 13 of the 17 pixels are white, and so is every wall
_REFRESH = 0.5  # chosen: share of the new picture in the model; one noisy picture does not replace it
_MARGIN_PITCHES = 0.75  # chosen: width of the white around the discs that belongs to the subimage

_DISCS = len(Disc)
_SIDES = ((0, -1), (0, 1), (-1, 0), (1, 0))  # top, bottom, left, right: half pitches to the right and down
_LATTICE = {Disc.LEFT: (-2, 0), Disc.MIDDLE: (0, 0), Disc.RIGHT: (2, 0), Disc.STEM: (0, 2)}


def _gaps() -> list[tuple[Disc, int, int]]:
    """Return the white points: a disc, and half pitches to the right of it and below it."""
    by_place = {
        (_LATTICE[disc][0] + right, _LATTICE[disc][1] + down): (disc, right, down)
        for disc in Disc
        for right, down in _SIDES
    }
    return list(by_place.values())


_GAPS = _gaps()
_GAP_DISCS = np.array([disc for disc, _, _ in _GAPS])
_IS_GAP = np.array([False] * _DISCS + [True] * len(_GAPS))
_GAP_STEPS: Floats = np.array([[right / 2, down / 2] for _, right, down in _GAPS])


def is_match(share: float) -> bool:
    """Return whether enough pixels agree for this to be the target.

    Example:
        >>> is_match(12 / 17), is_match(11 / 17)
        (True, False)
    """
    return share >= LEAST_MATCH


def skeleton_px(blobs_px: Floats) -> NDArray[np.intp]:
    """Return the pixels of the skeleton of discs at these places.

    Args:
        blobs_px: As ``Sighting.blobs_px``.

    Returns:
        Column and row, shape (17, 2), the four discs first; they may lie outside the picture.
    """
    across = (blobs_px[Disc.RIGHT] - blobs_px[Disc.LEFT]) / 2
    down = blobs_px[Disc.STEM] - blobs_px[Disc.MIDDLE]
    gaps = blobs_px[_GAP_DISCS] + _GAP_STEPS @ np.stack([across, down])
    pixels: NDArray[np.intp] = np.rint(np.concatenate([blobs_px, gaps])).astype(np.intp)
    return pixels


def levels_at(frame: Picture, pixels: NDArray[np.intp]) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
    """Return the grey levels at these pixels (0 outside the picture), and which of them lie in the picture."""
    height, width = frame.shape
    columns, rows = pixels[:, 0], pixels[:, 1]
    is_inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    levels = np.zeros(len(pixels), np.int16)
    levels[is_inside] = frame[rows[is_inside], columns[is_inside]]
    return levels, is_inside


def contrast(levels: NDArray[np.int16]) -> float:
    """Return the difference between the skeleton's gaps and its discs, in grey levels.

    Args:
        levels: Grey levels of the skeleton, shape (17,).
    """
    black, white = _black_and_white(levels)
    return white - black


def _black_and_white(levels: NDArray[np.int16]) -> tuple[float, float]:
    """Return the mean grey levels of the skeleton's discs and gaps."""
    each = levels.tolist()
    return sum(each[:_DISCS]) / _DISCS, sum(each[_DISCS:]) / len(_GAPS)


def landmark_match(frame: Picture, blobs_px: Floats) -> float:
    """Return the share of the skeleton that is black on a disc or white in a gap, for discs at these places.

    Returns:
        0 to 1; 0 if it cannot be a landmark, see ``TargetModel.match``.
    """
    levels, is_inside = levels_at(frame, skeleton_px(blobs_px))
    middle = sum(_black_and_white(levels)) / 2
    return _share(levels, is_inside, middle, _IS_GAP)


def _share(
    levels: NDArray[np.int16], is_inside: NDArray[np.bool_], middle: float, is_bright: NDArray[np.bool_]
) -> float:
    agrees = _agreement(levels, is_inside, middle, is_bright)
    if int(agrees[:_DISCS].sum()) < LEAST_DISCS or contrast(levels) < LEAST_CONTRAST:
        return 0.0
    return float(agrees.sum()) / SKELETON_PIXELS


def _agreement(
    levels: NDArray[np.int16], is_inside: NDArray[np.bool_], middle: float, is_bright: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    return np.asarray(((levels > middle) == is_bright) & is_inside, np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class TargetModel:
    """Model of the target from its last sighting.

    Attributes:
        blobs_px: Middles of its discs, as ``Sighting.blobs_px``.
        levels: Grey levels of the skeleton, shape (17,).
        subimage: The part of the picture with the target.
        corner_px: Column and row of the subimage's upper left pixel.
    """

    blobs_px: Floats
    levels: NDArray[np.int16]
    subimage: Picture
    corner_px: tuple[int, int]

    @property
    def middle_level(self) -> float:
        """Middle between the target's black and white."""
        return sum(_black_and_white(self.levels)) / 2

    @classmethod
    def seen(cls, frame: Picture, blobs_px: Floats) -> TargetModel:
        """Return the model of a target with discs at these places; pixels outside the picture count as black."""
        levels, _ = levels_at(frame, skeleton_px(blobs_px))
        return cls(blobs_px, levels, *_cut(frame, blobs_px))

    def updated(self, frame: Picture, blobs_px: Floats) -> TargetModel:
        """Return the model after a sighting at these places: new places, and levels half way to the new levels."""
        levels, is_inside = levels_at(frame, skeleton_px(blobs_px))
        blended = np.where(is_inside, (1 - _REFRESH) * self.levels + _REFRESH * levels, self.levels)
        return TargetModel(blobs_px, np.rint(blended).astype(np.int16), *_cut(frame, blobs_px))

    def match(self, frame: Picture, blobs_px: Floats) -> float:
        """Return the share of the skeleton that agrees for discs at these places; 0 if it cannot be a landmark.

        It cannot be a landmark if fewer than ``LEAST_DISCS`` discs are dark, or if gaps and discs differ by less than
        ``LEAST_CONTRAST``.
        """
        levels, is_inside = levels_at(frame, skeleton_px(blobs_px))
        middle = self.middle_level
        return _share(levels, is_inside, middle, self.levels > middle)

    def agreement(self, frame: Picture, blobs_px: Floats) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the pixels of the skeleton for discs at these places, and which of them agree; see ``match``.

        Returns:
            Column and row, shape (17, 2), and shape (17,).
        """
        pixels = skeleton_px(blobs_px)
        levels, is_inside = levels_at(frame, pixels)
        middle = self.middle_level
        return pixels, _agreement(levels, is_inside, middle, self.levels > middle)

    def subimage_match(self, frame: Picture, blobs_px: Floats) -> float:
        """Return the correlation of the subimage with the picture for discs at these places, -1 to 1.

        Pixels outside the picture are ignored; 0 if they are more than half of the subimage.
        """
        shift = np.rint((blobs_px - self.blobs_px).mean(axis=0)).astype(int)
        height, width = self.subimage.shape
        left, top = int(self.corner_px[0] + shift[0]), int(self.corner_px[1] + shift[1])
        columns = slice(max(0, left), min(frame.shape[1], left + width))
        rows = slice(max(0, top), min(frame.shape[0], top + height))
        if 2 * max(0, columns.stop - columns.start) * max(0, rows.stop - rows.start) < width * height:
            return 0.0
        there = frame[rows, columns]
        own = self.subimage[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        return correlation(there, own)

    def best_subimage_match(self, frame: Picture) -> tuple[float, tuple[int, int]]:
        """Return the best correlation of the subimage with the picture, both at half their size.

        Returns:
            The correlation, -1 to 1, and the shift from the last sighting: columns, rows.
        """
        small, own = (
            cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for image in (frame, self.subimage)
        )
        if own.shape[0] > small.shape[0] or own.shape[1] > small.shape[1]:
            return 0.0, (0, 0)
        scores = cv2.matchTemplate(small, own, cv2.TM_CCOEFF_NORMED)
        _, match, _, (column, row) = cv2.minMaxLoc(scores)
        return float(match), (2 * column - self.corner_px[0], 2 * row - self.corner_px[1])


def correlation(one: Picture, other: Picture) -> float:
    """Return the similarity of two pictures of one shape, independent of brightness and contrast.

    Same result as OpenCV's normalized template match for one place, but many times faster.

    Returns:
        -1 to 1; 0 if one picture is uniform.
    """
    first, second = one.ravel().astype(np.float32), other.ravel().astype(np.float32)
    first -= first.mean()
    second -= second.mean()
    scale = math.sqrt(float(first @ first) * float(second @ second))
    return float(first @ second) / scale if scale > 0 else 0.0


def plausible(blobs_px: Floats) -> bool:
    """Return whether four blobs can form the T: a level, evenly spaced row, and the stem under its middle.

    In the picture of a robot on a floor the row is nearly level and the column upright; seen from the side the row
    shrinks.
    """
    places: list[tuple[float, float]] = [(float(column), float(row)) for column, row in blobs_px]
    (left_x, left_y), (middle_x, middle_y), (right_x, right_y), (stem_x, stem_y) = places
    half_row, down = (right_x - left_x) / 2, stem_y - middle_y
    if down < 4.0 or not 0.3 * down < half_row < 1.25 * down:
        return False
    slack = 0.12 * down + 1.0
    return (
        abs(middle_x - (left_x + right_x) / 2) < slack
        and abs(middle_y - (left_y + right_y) / 2) < slack
        and abs(stem_x - middle_x) < slack + 0.1 * down
        and abs(right_y - left_y) < 0.5 * down
    )


def centred(frame: Picture, blobs_px: Floats, middle_level: float) -> Floats:
    """Return the blobs moved to the centres of the dark pixels around them.

    Method: mean shift of dark pixels in a window of one pitch; unlike connected regions, it tolerates torn rows.

    Args:
        blobs_px: Approximate places of the discs.
        middle_level: Pixels below it are dark; darker pixels weigh more.

    Returns:
        Places as ``blobs_px``; a blob without a dark pixel in its window is not moved.
    """
    height, width = frame.shape
    sighting = Sighting(blobs_px, 1.0)
    half_width = max(2, round(abs(float(sighting.across_px[0])) / 2))
    half_height = max(2, round(abs(float(sighting.down_px[1])) / 2))
    level = np.uint8(math.ceil(min(max(middle_level, 0.0), 255.0)))
    moved = blobs_px.copy()
    for disc in Disc:
        column, row = blobs_px[disc].tolist()
        for _ in range(2):
            left, top = max(0, round(column) - half_width), max(0, round(row) - half_height)
            right, bottom = min(width, round(column) + half_width + 1), min(height, round(row) + half_height + 1)
            if left >= right or top >= bottom:
                break
            darkness = level - np.minimum(frame[top:bottom, left:right], level)
            moments = cv2.moments(darkness)
            if moments["m00"] <= 0:
                break
            column, row = left + moments["m10"] / moments["m00"], top + moments["m01"] / moments["m00"]
        moved[disc] = column, row
    return moved


def _cut(frame: Picture, blobs_px: Floats) -> tuple[Picture, tuple[int, int]]:
    """Return a copy of the part of the picture with the discs and some white around them, and its upper left pixel."""
    sighting = Sighting(blobs_px, 1.0)
    (left, top), (right, bottom) = blobs_px.min(axis=0).tolist(), blobs_px.max(axis=0).tolist()
    beside, above = (_MARGIN_PITCHES * abs(float(extent)) for extent in (sighting.across_px[0], sighting.down_px[1]))
    height, width = frame.shape
    column, row = (
        max(0, min(math.floor(low), size - 1)) for low, size in ((left - beside, width), (top - above, height))
    )
    end_column, end_row = max(column + 1, math.ceil(right + beside) + 1), max(row + 1, math.ceil(bottom + above) + 1)
    return frame[row:end_row, column:end_column].copy(), (column, row)
