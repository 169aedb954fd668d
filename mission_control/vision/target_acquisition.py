"""Find the landmark in a picture of which nothing is known yet.

Fixed threshold to binary → dark regions → any four whose places make the landmark's T → the skeleton
must match.  A robot that finds nothing turns a few degrees and tries again.

Source: RAM 2002, "Visual Servoing": a fixed threshold makes the picture binary, and it is searched for
a pattern consistent with the known target geometry.
"""

from __future__ import annotations

import cv2
import numpy as np

from mission_control.vision.landmark import Floats, Picture, Sighting
from mission_control.vision.skeleton_model import TargetModel, centred, is_match, landmark_match, plausible

THRESHOLD = 62  # measured: at 85 the floor's grey passes and is taken for a disc
LEAST_AREA_PX = 5  # chosen: a disc seen from 2.5 m away and 45 degrees aside has 20 pixels, noise takes some
MOST_AREA_PX = 4000  # chosen: a disc seen from 0.3 m away has 2700
MOST_REGIONS = 60  # chosen: a torn picture has hundreds of regions and is not worth the search


def acquire(frame: Picture) -> Sighting | None:
    """Return where the landmark is in the picture, or None.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

    Raises:
        ValueError: It is no grey picture.
    """
    if frame.ndim != 2 or frame.dtype != np.uint8:
        raise ValueError(f"a grey picture has shape (height, width) and bytes, not {frame.shape} of {frame.dtype}")
    best: Sighting | None = None
    for blobs_px in _tees(_dark_regions(frame)):
        found = _confirmed(frame, blobs_px)
        if found is not None and (best is None or found.match > best.match):
            best = found
    return best


def _dark_regions(frame: Picture) -> Floats:
    """Return the middles of regions that could be discs: column and row, shape (n, 2), n up to ``MOST_REGIONS``."""
    _, binary = cv2.threshold(frame, THRESHOLD, 255, cv2.THRESH_BINARY_INV)
    _, _, stats, middles = cv2.connectedComponentsWithStats(binary, connectivity=4)
    width, height, area = (stats[1:, column] for column in (cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA))
    is_disc = (area >= LEAST_AREA_PX) & (area <= MOST_AREA_PX)
    is_disc &= (width <= 1.6 * height + 1) & (height <= 3.0 * width + 2) & (area >= 0.45 * width * height)
    kept: Floats = np.asarray(middles[1:][is_disc], np.float64)
    return kept[np.argsort(-area[is_disc], kind="stable")[:MOST_REGIONS]]


def _tees(middles: Floats) -> list[Floats]:
    """Return every four of the regions that make the T, each of shape (4, 2)."""
    found: list[Floats] = []
    places = middles.tolist()
    for middle, (x, y) in enumerate(places):
        below = [n for n, (nx, ny) in enumerate(places) if ny - y >= 4 and abs(nx - x) <= 0.25 * (ny - y) + 1]
        for stem in below:
            down = places[stem][1] - y
            lefts = [n for n, (nx, ny) in enumerate(places) if 0 < x - nx < 1.4 * down and abs(ny - y) < 0.4 * down]
            rights = [n for n, (nx, ny) in enumerate(places) if 0 < nx - x < 1.4 * down and abs(ny - y) < 0.4 * down]
            for left in lefts:
                for right in rights:
                    blobs_px = middles[[left, middle, right, stem]]
                    if plausible(blobs_px):
                        found.append(blobs_px)
    return found


def _confirmed(frame: Picture, blobs_px: Floats) -> Sighting | None:
    """Return the sighting if the picture has discs and gaps where the T has them."""
    model = TargetModel.seen(frame, blobs_px)
    placed = centred(frame, blobs_px, model.middle_level)
    if not plausible(placed):
        return None
    share = landmark_match(frame, placed)
    return Sighting(placed, share) if is_match(share) else None
