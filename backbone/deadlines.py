"""Deadlines: detects late repeated messages. Pure; times are seconds of the mission."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

FIRST_S = 5.0  # chosen: a mission is up within it, and a replaced component answers within it


class Deadlines:
    """Reports each missed deadline once, and once more when a message of its key comes again.

    Args:
        within_s: Key → seconds after a message within which the next one must come.
        now_s: The first message of a key may come ``FIRST_S`` later, or within its deadline if that is longer.
    """

    def __init__(self, within_s: Mapping[str, float], now_s: float) -> None:
        self._within_s = dict(within_s)
        self._due_s = {key: now_s + max(most_s, FIRST_S) for key, most_s in within_s.items()}
        self._late_since_s: dict[str, float] = {}
        self.missed = Counter[str]()
        """Key → how often its deadline was missed."""

    @property
    def next_s(self) -> float:
        """Time at which to call ``newly_missed`` again, if no message comes before."""
        return min((due_s for key, due_s in self._due_s.items() if key not in self._late_since_s), default=math.inf)

    @property
    def late(self) -> tuple[str, ...]:
        """Keys whose deadline is missed at present."""
        return tuple(self._late_since_s)

    def came(self, key: str, now_s: float) -> float | None:
        """Record a message; return how long after its deadline it came, if that was missed."""
        if key not in self._within_s:
            return None
        if now_s >= self._due_s[key]:
            self._miss(key)
        self._due_s[key] = now_s + self._within_s[key]
        since_s = self._late_since_s.pop(key, None)
        return None if since_s is None else now_s - since_s

    def newly_missed(self, now_s: float) -> list[str]:
        """Return the keys whose deadline has passed, each missed deadline once."""
        found = [key for key, due_s in self._due_s.items() if now_s >= due_s and key not in self._late_since_s]
        for key in found:
            self._miss(key)
        return found

    def _miss(self, key: str) -> None:
        if key not in self._late_since_s:
            self._late_since_s[key] = self._due_s[key]
            self.missed[key] += 1
