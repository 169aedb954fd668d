"""Which log lines are written and which are only counted.

Rules of this file: no clock, no file; times are seconds of the machine, which never run backwards.

* A line that says the same as the last one from its place in the code is counted.
* So is every line beyond ``BURST`` from one place in ``WINDOW_S``, whatever it says: hostile messages all differ.
* What was counted is told at the end of the window, in one line.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

BURST = 10  # chosen: enough to see what it is about
WINDOW_S = 10.0  # chosen: six lines a minute from a place that is never quiet: half a megabyte a day
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
    """Remembers what was said at each place in the code."""

    def __init__(self) -> None:
        self._windows: OrderedDict[Place, _Window] = OrderedDict()

    def is_new(self, place: Place, line: str, now_s: float) -> bool:
        """Return whether this line is to be written; else it was counted. Ask ``due`` first."""
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
        """Return one line for each place whose window is over and that was counted; the next window is open."""
        told = []
        for place, window in list(self._windows.items()):
            if now_s < window.began_s + WINDOW_S:
                break  # they are in the order of their beginnings
            told += self._close(place)
        while len(self._windows) > MOST_PLACES:
            told += self._close(next(iter(self._windows)))
        return told

    def rest(self) -> list[str]:
        """Return one line for each place that was counted; all windows are closed."""
        return [line for place in list(self._windows) for line in self._close(place)]

    def _close(self, place: Place) -> list[str]:
        window = self._windows.pop(place)
        return [window.summary()] if window.counted else []
