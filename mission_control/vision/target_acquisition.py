"""Finds the landmark in a picture without prior knowledge.

Fixed threshold to binary → dark regions → every four regions that form the landmark's T → the skeleton must match. If a
robot does not find the target, it turns a few degrees and tries again.

Source: RAM 2002, "Visual Servoing": a fixed threshold makes the picture binary, and it is searched for
a pattern consistent with the known target geometry.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from mission_control.vision.landmark import DISC_DIAMETER_M, PITCH_M, Floats, Picture, Sighting
from mission_control.vision.skeleton_model import TargetModel, centred, is_match, landmark_match, plausible

THRESHOLD = 62  # measured: at 85 the floor's grey counts as dark and is mistaken for a disc
LEAST_AREA_PX = 5  # chosen: a disc seen from 2.5 m away and 45 degrees aside has 20 pixels, noise takes some
MOST_AREA_PX = 4000  # chosen: a disc seen from 0.3 m away has 2700
MOST_REGIONS = 60  # chosen: of the largest regions; a room has 10, and the discs are larger than noise
LEAST_PITCH_PX = 4.0  # chosen: a disc of three pixels
DISC_SHARE = math.pi / 4 * (DISC_DIAMETER_M / PITCH_M) ** 2  # of a square of one pitch
LEAST_SHARE, MOST_SHARE = 0.35, 2.0  # chosen: of that; at 2.5 m a pixel more or less around a disc is half of its area
LIKE = 3.0  # chosen: largest ratio of two discs' areas, near, from the side, and with noise


def acquire(frame: Picture) -> Sighting | None:
    """Return the landmark's place in the picture, or None.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

    Raises:
        ValueError: It is no grey picture.
    """
    if frame.ndim != 2 or frame.dtype != np.uint8:
        raise ValueError(f"a grey picture has shape (height, width) and bytes, not {frame.shape} of {frame.dtype}")
    best: Sighting | None = None
    for blobs_px in _tees(*dark_regions(frame)):
        found = _confirmed(frame, blobs_px)
        if found is not None and (best is None or found.match > best.match):
            best = found
    return best


def dark_regions(frame: Picture) -> tuple[Floats, Floats]:
    """Return the candidates for discs: middles (column and row), shape (n, 2), and areas, (n,); the largest first."""
    _, binary = cv2.threshold(frame, THRESHOLD, 255, cv2.THRESH_BINARY_INV)
    _, _, stats, middles = cv2.connectedComponentsWithStats(binary, connectivity=4)
    width, height, area = (stats[1:, column] for column in (cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA))
    is_disc = (area >= LEAST_AREA_PX) & (area <= MOST_AREA_PX)
    is_disc &= (width <= 1.6 * height + 1) & (height <= 3.0 * width + 2) & (area >= 0.45 * width * height)
    kept: Floats = middles[1:][is_disc].astype(np.float64)
    areas: Floats = area[is_disc].astype(np.float64)
    order = np.argsort(-areas, kind="stable")[:MOST_REGIONS]
    return kept[order], areas[order]


def _tees(middles: Floats, areas: Floats) -> list[Floats]:
    """Return each set of four regions that form the T and have the size of its discs, each of shape (4, 2)."""
    found: list[Floats] = []
    right_px, down_px = (middles[np.newaxis, :, axis] - middles[:, np.newaxis, axis] for axis in (0, 1))
    is_stem = (down_px >= LEAST_PITCH_PX) & (np.abs(right_px) <= 0.25 * down_px + 1)
    is_stem &= (areas < LIKE * areas[:, np.newaxis]) & (areas[:, np.newaxis] < LIKE * areas)
    for middle, stem in np.argwhere(is_stem).tolist():
        down, aside = float(down_px[middle, stem]), np.abs(right_px[middle])
        share = areas / (DISC_SHARE * down * np.maximum(aside, 1.0))
        is_beside = (aside < 1.4 * down) & (np.abs(down_px[middle]) < 0.4 * down)
        is_beside &= (share > LEAST_SHARE) & (share < MOST_SHARE)
        for left in np.flatnonzero(is_beside & (right_px[middle] < 0)).tolist():
            for right in np.flatnonzero(is_beside & (right_px[middle] > 0)).tolist():
                blobs_px = middles[[left, middle, right, stem]]
                if plausible(blobs_px):
                    found.append(blobs_px)
    return found


def _confirmed(frame: Picture, blobs_px: Floats) -> Sighting | None:
    """Return the sighting if the picture has discs and gaps at the places of the T."""
    model = TargetModel.seen(frame, blobs_px)
    placed = centred(frame, blobs_px, model.middle_level)
    if not plausible(placed):
        return None
    share = landmark_match(frame, placed)
    return Sighting(placed, share) if is_match(share) else None
