"""The landmark on a home base: four dark discs in a T on a white board, upright on the floor.

The board's frame: for an observer who faces the board, ``left`` is positive to the left of the board's middle; heights
are above the floor.

Source: RAM 2002, "Visual Servoing": an easy-to-detect landmark of four blobs marks a home base or a
deployment platform.  Sizes: chosen; a disc is 9 pixels wide from 2 m away, and the whole T is still
in the picture from 0.4 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Floats = NDArray[np.float64]

DISC_DIAMETER_M = 0.04  # chosen: 9 pixels from 2 m away
PITCH_M = 0.06  # chosen: between the middles of neighbouring discs; leaves half a disc of white between them
BOARD_WIDTH_M, BOARD_HEIGHT_M = 0.28, 0.17  # chosen: white around every disc, for skeleton pixels
CENTRE_HEIGHT_M = 0.075  # chosen: between the T's two rows; above the camera, within its tilted view


class Disc(IntEnum):
    """Rows of every array of blobs: three discs in a row, and the stem under the middle one."""

    LEFT = 0
    MIDDLE = 1
    RIGHT = 2
    STEM = 3


DISCS_M: Floats = np.array(
    [
        [PITCH_M, CENTRE_HEIGHT_M + PITCH_M / 2],
        [0.0, CENTRE_HEIGHT_M + PITCH_M / 2],
        [-PITCH_M, CENTRE_HEIGHT_M + PITCH_M / 2],
        [0.0, CENTRE_HEIGHT_M - PITCH_M / 2],
    ]
)
"""Middles of the discs: left and height, shape (4, 2), rows as in ``Disc``."""


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """Place of the landmark in a picture.

    Attributes:
        blobs_px: Middles of its discs: column and row, shape (4, 2), rows as in ``Disc``.  Whole numbers
            are the middles of pixels, the origin is the upper left one.
        match: Share of the target that agreed with its model, 0.7 to 1.
    """

    blobs_px: Floats
    match: float

    @property
    def across_px(self) -> Floats:
        """From one disc of the row to its right neighbour, shape (2,)."""
        return np.asarray((self.blobs_px[Disc.RIGHT] - self.blobs_px[Disc.LEFT]) / 2)

    @property
    def down_px(self) -> Floats:
        """From the middle disc to the stem, shape (2,)."""
        return np.asarray(self.blobs_px[Disc.STEM] - self.blobs_px[Disc.MIDDLE])

    @property
    def pitch_px(self) -> float:
        """Distance of the two discs above each other; unlike the row it does not shrink when seen from the side."""
        return math.hypot(*self.down_px.tolist())
