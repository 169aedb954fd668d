"""Pictures in a terminal: two pixels a cell, 24 greys, equal neighbors drawn at once.

Half blocks in the 24 greys of the 256-color palette hold 15 pictures a second in a terminal; more
colors cost a new style for nearly every cell and fall to 4.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import Segment
from rich.style import Style

GREYS = 24
FIRST_GREY = 232  # of the terminal's 256 colors; the last grey is 255
UPPER_HALF = "▀"
STYLES_KEPT = 4096  # chosen: all pairs of 24 greys are 576


def shrink(picture: NDArray[np.uint8], columns: int, rows: int) -> NDArray[np.uint8]:
    """Return the picture in grey steps for that many cells, each pixel the mean of its area.

    Args:
        picture: Grey levels 0 to 255, shape (height, width), row 0 on top.
        columns: Cells across, at least 1.
        rows: Cells down, at least 1.

    Returns:
        Grey steps 0 to 23, shape (2 × rows, columns).

    Example:
        >>> shrink(np.array([[0, 255], [255, 255]], np.uint8), columns=2, rows=1)
        array([[ 0, 23],
               [23, 23]], dtype=uint8)
    """
    height, width = picture.shape
    top = np.arange(2 * rows) * height // (2 * rows)
    left = np.arange(columns) * width // columns
    # reduceat returns the single element where two neighbors share a start, as enlarging needs.
    sums = np.add.reduceat(np.add.reduceat(picture.astype(np.uint32), top, axis=0), left, axis=1)
    tall = np.maximum(1, np.diff(np.append(top, height)))
    wide = np.maximum(1, np.diff(np.append(left, width)))
    means = sums // (tall[:, np.newaxis] * wide[np.newaxis, :])
    return np.asarray(means * GREYS // 256, np.uint8)


def row_segments(steps: NDArray[np.uint8], row: int) -> list[Segment]:
    """Return one row of cells, runs of equal cells in one segment each.

    Args:
        steps: As from ``shrink``.
        row: Of cells, 0 on top.
    """
    return [Segment(UPPER_HALF * length, _style(upper, lower)) for length, upper, lower in _runs(steps, row)]


def fit(width_px: int, height_px: int, columns: int, rows: int) -> tuple[int, int]:
    """Return the largest columns and rows that keep the picture's shape; a cell is twice as high as wide.

    Example:
        >>> fit(320, 240, columns=80, rows=40)
        (80, 30)
    """
    scale = min(columns / width_px, 2 * rows / height_px)
    return max(1, int(width_px * scale)), max(1, int(height_px * scale / 2))


def _runs(steps: NDArray[np.uint8], row: int) -> Iterator[tuple[int, int, int]]:
    upper, lower = steps[2 * row].astype(np.int32), steps[2 * row + 1].astype(np.int32)
    pairs = upper * GREYS + lower
    starts = np.flatnonzero(np.diff(pairs, prepend=-1))
    lengths = np.diff(np.append(starts, len(pairs)))
    for start, length in zip(starts.tolist(), lengths.tolist(), strict=True):
        pair = int(pairs[start])
        yield length, pair // GREYS, pair % GREYS


@lru_cache(maxsize=STYLES_KEPT)
def _style(upper: int, lower: int) -> Style:
    return Style(color=Color.from_ansi(FIRST_GREY + upper), bgcolor=Color.from_ansi(FIRST_GREY + lower))
