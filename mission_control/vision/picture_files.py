"""Pictures as files."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def png_of(picture: NDArray[np.uint8], size_px: tuple[int, int]) -> bytes:
    """Return a PNG file with three equal channels.

    Args:
        picture: Grey levels 0 to 255, shape (height, width).
        size_px: Width and height; a picture of another size is scaled.
    """
    if picture.shape[::-1] != size_px:
        picture = np.asarray(cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA), np.uint8)
    _done, file = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
    return bytes(file)
