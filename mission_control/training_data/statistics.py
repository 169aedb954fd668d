"""Statistics of the columns of a data set; training uses them for normalization. Pure.

Source: ``meta/stats.json`` of LeRobotDataset v3.0, for names and shapes; see ``lerobot_dataset``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

PERCENTS = (1, 10, 50, 90, 99)
LEVELS = 256
CHANNELS = 3

Statistics = dict[str, list[object]]


def of_numbers(rows: NDArray[np.float64]) -> Statistics:
    """Return the statistics of each column.

    Args:
        rows: Shape (rows, columns), at least one row.

    Example:
        >>> found = of_numbers(np.array([[1.0], [3.0]]))
        >>> found["mean"], found["std"], found["count"]
        ([2.0], [1.0], [2])
    """
    found = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0)}
    found |= {f"q{percent:02d}": np.quantile(rows, percent / 100, axis=0) for percent in PERCENTS}
    return _listed(found, len(rows))


def of_levels(histogram: NDArray[np.int64], pictures: int) -> Statistics:
    """Return the statistics of grey levels, as shares of white, equal for each of three channels.

    Args:
        histogram: Number of pixels of each level, shape (256,), at least one pixel.
        pictures: Number of pictures.
    """
    levels, shares = np.arange(LEVELS) / (LEVELS - 1), histogram / histogram.sum()
    mean = float(levels @ shares)
    seen, below = np.flatnonzero(histogram), np.cumsum(histogram)
    found = {"min": levels[seen[0]], "max": levels[seen[-1]], "mean": mean}
    found["std"] = np.sqrt(((levels - mean) ** 2) @ shares)
    for percent in PERCENTS:
        found[f"q{percent:02d}"] = levels[np.searchsorted(below, percent / 100 * below[-1])]
    return _listed({name: np.full((CHANNELS, 1, 1), value) for name, value in found.items()}, pictures)


def _listed(found: Mapping[str, NDArray[np.float64]], count: int) -> Statistics:
    return {name: value.tolist() for name, value in found.items()} | {"count": [count]}
