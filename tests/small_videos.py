"""Video files of a few pictures, made for a test: picture n is uniformly of grey level 40 n."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

STEP = 40
WIDTH_PX, HEIGHT_PX = 64, 48


def video(path: Path, pictures: int = 6, rate_hz: float = 10.0) -> Path:
    """Write a video; return its path."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, (WIDTH_PX, HEIGHT_PX))
    assert writer.isOpened()
    for number in range(pictures):
        writer.write(np.full((HEIGHT_PX, WIDTH_PX, 3), STEP * number, np.uint8))
    writer.release()
    return path


def number_of(pixels: memoryview) -> int:
    """Return which picture these pixels are."""
    return round(sum(pixels) / len(pixels) / STEP)
