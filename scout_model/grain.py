"""Grain: noise in whole grey levels, to be added to pictures."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
"""Grey levels 0 to 255, shape (height, width)."""


@dataclass(frozen=True, slots=True)
class Grain:
    """Noise in whole grey levels, its two signs apart: of pictures of one type OpenCV adds many pixels at a time.

    Attributes:
        brighter: What it adds, 0 where it darkens.
        darker: What it takes away, 0 where it brightens.
    """

    brighter: Picture
    darker: Picture

    @classmethod
    def of(cls, levels: NDArray[np.float64] | NDArray[np.float32], factor: float = 1.0) -> Grain:
        """Return it for these levels times the factor, which is below 2**31 in magnitude.

        More than a picture's range has no further effect.
        """
        # OpenCV rounds to the nearest whole level, halves to even, and cuts off at 0 and 255.
        brighter, darker = (
            cv2.addWeighted(levels, sign * factor, levels, 0.0, 0.0, dtype=cv2.CV_8U) for sign in (1.0, -1.0)
        )
        return cls(np.asarray(brighter, np.uint8), np.asarray(darker, np.uint8))

    def on(self, picture: Picture) -> Picture:
        """Return the picture with this noise, within 0 to 255."""
        brightened = cv2.add(picture, self.brighter)
        return np.asarray(cv2.subtract(brightened, self.darker, dst=brightened), np.uint8)
