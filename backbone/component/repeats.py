"""Repeats: decides which log lines are written and which are only counted.

Rules of this file: no clock, no file; times are seconds of the machine, which never run backwards.

* A line that equals the last line from the same place in the code is counted.
* Each line beyond ``BURST`` from one place in ``WINDOW_S`` is counted too, because hostile messages all differ.
* At the end of the window, one line gives the count.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

BURST = 10  # chosen: enough to recognize the fault
WINDOW_S = 10.0  # chosen: at most six lines a minute from one place, half a megabyte a day
MOST_PLACES = 256  # chosen: more than there are log calls in this project

Place = tuple[str, int]
"""File and line of the log call."""


@dataclass(slots=True)
class _Window:
    began_s: float
    last: str = ""
    written: int = 0
    counted: int = 0

    def summary(self) -> str:
        return f"repeated {self.counted} times within {WINDOW_S:.0f} s, the last time as: {self.last}"


class Repeats:
    """The recent log lines of each place in the code."""

    def __init__(self) -> None:
        self._windows: OrderedDict[Place, _Window] = OrderedDict()

    def is_new(self, place: Place, line: str, now_s: float) -> bool:
        """Return whether to write this line, else count it. Call ``due`` first."""
        window = self._windows.get(place)
        if window is None:
            window = self._windows[place] = _Window(now_s)
        if window.written >= BURST or window.last == line:
            window.counted += 1
            window.last = line
            return False
        window.written += 1
        window.last = line
        return True

    def due(self, now_s: float) -> list[str]:
        """Return the counts of all places whose window has ended, one line each, and open their next windows."""
        counts = []
        for place, window in list(self._windows.items()):
            if now_s < window.began_s + WINDOW_S:
                break  # windows are in the order of their starts
            counts += self._close(place)
        while len(self._windows) > MOST_PLACES:
            counts += self._close(next(iter(self._windows)))
        return counts

    def rest(self) -> list[str]:
        """Return the counts of all places, one line each, and close all windows."""
        return [line for place in list(self._windows) for line in self._close(place)]

    def _close(self, place: Place) -> list[str]:
        window = self._windows.pop(place)
        return [window.summary()] if window.counted else []
