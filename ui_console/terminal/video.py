"""Pictures in a terminal: two pixels per cell, 24 greys or 216 colors; equal neighbors are drawn together.

Half blocks in the 24 greys of the 256-color palette reach 15 pictures a second in a terminal; with more colors nearly
every cell needs a new style, and the rate falls to 4.
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
FIRST_COLOR, CUBE = 16, 6  # of the same: six steps of red, green and blue each
UPPER_HALF = "▀"
STYLES_KEPT = 4096  # chosen: 24 greys have 576 pairs, and few pairs of colors occur


def shrink(picture: NDArray[np.uint8], columns: int, rows: int) -> NDArray[np.uint8]:
    """Return the picture in steps of grey or color for this number of cells; each pixel is the mean of its area.

    Args:
        picture: Grey levels 0 to 255 of shape (height, width), or red, green and blue of shape (height, width, 3), row
            0 on top.
        columns: Cells across, at least 1.
        rows: Cells down, at least 1.

    Returns:
        Steps 0 to 23 of grey, shape (2 × rows, columns), or of red, green and blue, shape (2 × rows, columns, 3).

    Example:
        >>> shrink(np.array([[0, 255], [255, 255]], np.uint8), columns=2, rows=1)
        array([[ 0, 23],
               [23, 23]], dtype=uint8)
    """
    height, width = picture.shape[:2]
    top = np.arange(2 * rows) * height // (2 * rows)
    left = np.arange(columns) * width // columns
    # reduceat returns the single element where two neighbors share a start, as enlarging needs.
    sums = np.add.reduceat(np.add.reduceat(picture.astype(np.uint32), top, axis=0), left, axis=1)
    tall = np.maximum(1, np.diff(np.append(top, height)))
    wide = np.maximum(1, np.diff(np.append(left, width)))
    areas = tall[:, np.newaxis] * wide[np.newaxis, :]
    means = sums // (areas if picture.ndim == 2 else areas[:, :, np.newaxis])
    return np.asarray(means * GREYS // 256, np.uint8)


def row_segments(steps: NDArray[np.uint8], row: int) -> list[Segment]:
    """Return one row of cells; each run of equal cells is one segment.

    Args:
        steps: Result of ``shrink``.
        row: Row of cells, 0 on top.
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
    upper, lower = _colors(steps[2 * row]), _colors(steps[2 * row + 1])
    pairs = upper * 256 + lower
    starts = np.flatnonzero(np.diff(pairs, prepend=-1))
    lengths = np.diff(np.append(starts, len(pairs)))
    for start, length in zip(starts.tolist(), lengths.tolist(), strict=True):
        pair = int(pairs[start])
        yield length, pair // 256, pair % 256


def _colors(steps: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return the palette numbers of a row's colors; colors without hue become one of the 24 greys."""
    whole = steps.astype(np.int32)
    if whole.ndim == 1:
        return whole + FIRST_GREY
    red, green, blue = (whole[:, channel] for channel in range(3))
    cubed = (whole * CUBE // GREYS) @ np.array([CUBE * CUBE, CUBE, 1], np.int32) + FIRST_COLOR
    return np.where((red == green) & (green == blue), red + FIRST_GREY, cubed)


@lru_cache(maxsize=STYLES_KEPT)
def _style(upper: int, lower: int) -> Style:
    return Style(color=Color.from_ansi(upper), bgcolor=Color.from_ansi(lower))
