"""Views of the tracker for people: candidates for discs, and the skeleton with its matched pixels.

Rules of this file: no bus, no clock; a picture goes in, a picture in color of the same size comes out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mission_control.vision.landmark import Floats, Picture
from mission_control.vision.skeleton_model import TargetModel
from mission_control.vision.target_acquisition import THRESHOLD, dark_regions

Color = tuple[int, int, int]
MATCHED: Color = (0, 255, 0)
MISSED: Color = (255, 0, 0)
CANDIDATE: Color = (255, 255, 0)
DARK: Color = (0, 0, 160)
ARM_PX = 2  # chosen: a cross of five pixels is visible in a picture of 320 columns and hides no disc


def blobs_view(frame: Picture, blobs_px: Floats | None) -> NDArray[np.uint8]:
    """Return the picture with dark pixels in blue, candidates for discs marked yellow, and the discs green.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.
        blobs_px: Middles of the discs that were found, as ``Sighting.blobs_px``; None: not found.

    Returns:
        Red, green and blue, shape (height, width, 3).
    """
    drawn = in_color(frame)
    drawn[frame <= THRESHOLD] = DARK
    middles, _areas = dark_regions(frame)
    for column, row in np.rint(middles).astype(int).tolist():
        mark(drawn, column, row, CANDIDATE)
    for column, row in [] if blobs_px is None else np.rint(blobs_px).astype(int).tolist():
        mark(drawn, column, row, MATCHED)
    return drawn


def skeleton_view(frame: Picture, model: TargetModel | None) -> NDArray[np.uint8]:
    """Return the picture with the 17 pixels of the skeleton where the target was last seen.

    Green pixels agree with the model, red ones do not; pixels outside the picture are not drawn.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.
        model: Model of the last sighting; None: the target is not known, and no skeleton is drawn.

    Returns:
        Red, green and blue, shape (height, width, 3).
    """
    drawn = in_color(frame)
    if model is None:
        return drawn
    pixels, agrees = model.agreement(frame, model.blobs_px)
    for (column, row), does_agree in zip(pixels.tolist(), agrees.tolist(), strict=True):
        mark(drawn, column, row, MATCHED if does_agree else MISSED)
    return drawn


def in_color(frame: Picture) -> NDArray[np.uint8]:
    """Return a copy of a grey picture as red, green and blue."""
    return np.repeat(frame[:, :, np.newaxis], 3, axis=2)


def mark(drawn: NDArray[np.uint8], column: int, row: int, color: Color) -> None:
    """Draw the part of a cross of this color that lies in the picture."""
    height, width = drawn.shape[:2]
    if 0 <= row < height:
        drawn[row, max(0, column - ARM_PX) : max(0, column + ARM_PX + 1)] = color
    if 0 <= column < width:
        drawn[max(0, row - ARM_PX) : max(0, row + ARM_PX + 1), column] = color
