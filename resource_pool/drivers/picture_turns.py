"""Picture turns: which of a camera's pictures are delivered, so that there are no more than requested.

Rules of this file: pure; times are arguments, of any clock.
"""

from __future__ import annotations

import math

EARLY_S = 1 / 120  # chosen: a quarter of a frame, so that rounded frame times skip no frame


class PictureTurns:
    """The turns of one camera's pictures.

    Example:
        >>> turns = PictureTurns()
        >>> [turns.take(frame / 30, 15.0) for frame in range(4)]
        [True, False, True, False]
    """

    def __init__(self) -> None:
        self._last_s = self._next_s = -math.inf

    def begin(self) -> None:
        """Let the next picture have its turn."""
        self._last_s = self._next_s = -math.inf

    def take(self, at_s: float, rate_hz: float) -> bool:
        """Return whether a picture of this time has its turn; if so, the next turn is one pause of this rate later.

        A picture older than the last one has its turn, too: the camera's clock was set back, or was wrong once.
        """
        if at_s < self._last_s:
            self.begin()
        if at_s < self._next_s - EARLY_S:
            return False
        pause_s = 1.0 / rate_hz
        in_time = at_s < self._next_s + pause_s
        self._last_s = at_s
        self._next_s = (self._next_s if in_time else at_s) + pause_s
        return True
