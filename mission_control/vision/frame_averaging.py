"""The earlier method: average the last pictures; a difference from the previous average counts as motion.

Averaging reduces white noise and thin lines in proportion to the number of pictures, and smears moving bodies. It has
no effect on torn and partial pictures. It is kept for comparison with ``motion_detection``.

Source: RAM 2002, "Visual Servoing", on previous work: a simple frame-averaging algorithm that only
dealt with the problem of spurious horizontal lines and white noise.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from mission_control.vision.landmark import Picture
from mission_control.vision.motion_detection import LEAST_DIFFERENCE, Blob, halve, largest_blob

AVERAGED = 4  # chosen: halves white noise, a line becomes a quarter as strong, and costs an eighth of a second


def average(frames: list[Picture]) -> Picture:
    """Return the mean of some pictures.

    Args:
        frames: At least one, grey levels 0 to 255, all of one shape (height, width).

    Returns:
        Grey levels, the same shape, rounded.

    Raises:
        ValueError: There is no picture, or shapes differ.

    Example:
        >>> average([np.array([[0, 10]], np.uint8), np.array([[100, 20]], np.uint8)])
        array([[50, 15]], dtype=uint8)
    """
    if not frames:
        raise ValueError("the average of no picture is nothing")
    if any(frame.shape != frames[0].shape for frame in frames):
        raise ValueError(f"pictures of shapes {sorted({frame.shape for frame in frames})} have no average")
    total = np.zeros(frames[0].shape, np.float32)
    for frame in frames:
        cv2.accumulate(frame, total)
    return np.rint(total / len(frames)).astype(np.uint8)


class FrameAveraging:
    """Averages one camera's pictures and compares each average with the one before it.

    Args:
        averaged: Number of pictures in an average, 1 or more.

    Raises:
        ValueError: The number is less than 1.
    """

    def __init__(self, averaged: int = AVERAGED) -> None:
        if averaged < 1:
            raise ValueError(f"an average of {averaged} pictures; take 1 or more")
        self._averaged = averaged
        self._frames: deque[Picture] = deque(maxlen=2 * averaged)

    def swapped_in(self) -> None:
        """Begin again, because older pictures may show another view."""
        self._frames.clear()

    def look(self, frame: Picture) -> Blob | None:
        """Return the largest region in which the last pictures differ from the ones before, or None.

        Args:
            frame: Grey levels 0 to 255, shape (height, width), row 0 on top; after a change of shape the averaging
                begins again.

        Raises:
            ValueError: The array is not a grey picture of at least 2 × 2 pixels.
        """
        if frame.ndim != 2 or min(frame.shape) < 2:
            raise ValueError(f"a grey picture has shape (height, width), not {frame.shape}")
        small = halve(frame)
        if self._frames and self._frames[0].shape != small.shape:
            self._frames.clear()
        self._frames.append(small)
        if len(self._frames) < 2 * self._averaged:
            return None
        frames = list(self._frames)
        before, now = average(frames[: self._averaged]), average(frames[self._averaged :])
        changed: NDArray[np.bool_] = np.asarray(cv2.absdiff(before, now) > LEAST_DIFFERENCE, np.bool_)
        return largest_blob(changed, drop_streaks=False)
