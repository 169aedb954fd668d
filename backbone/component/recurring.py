"""Recurring trouble: reported when it begins, and once after it has stayed away; recurrences in between are counted.

Rules of this file: pure; times are arguments, of any clock.
"""

from __future__ import annotations

import math

CALM_S = 5.0  # chosen: longer than a round of anything that fails in each round; machine seconds


class Recurring:
    """Troubles of some subjects.

    Args:
        calm_s: Trouble that stays away for so long is over.
    """

    def __init__(self, calm_s: float = CALM_S) -> None:
        self._calm_s = calm_s
        self._counts: dict[str, int] = {}
        self._over_s: dict[str, float] = {}

    @property
    def next_s(self) -> float:
        """Time at which to call ``over`` again; infinite: after the next ``goes``."""
        return min(self._over_s.values(), default=math.inf)

    def comes(self, subject: str) -> bool:
        """Record that the trouble of a subject begins; return whether to say so.

        Example:
            >>> troubles = Recurring(calm_s=5.0)
            >>> troubles.comes("radio"), troubles.goes("radio", 1.0), troubles.comes("radio")
            (True, 6.0, False)
            >>> troubles.goes("radio", 2.0), troubles.over(6.9), troubles.over(7.0)
            (7.0, {}, {'radio': 2})
        """
        self._over_s.pop(subject, None)
        self._counts[subject] = self._counts.get(subject, 0) + 1
        return self._counts[subject] == 1

    def goes(self, subject: str, now_s: float) -> float:
        """Record that the trouble of a subject ends; return the time at which it is over unless it comes again."""
        if subject in self._counts:
            self._over_s[subject] = now_s + self._calm_s
        return now_s + self._calm_s

    def over(self, now_s: float) -> dict[str, int]:
        """Return the subjects whose trouble is over, with the number of times it came, and forget them."""
        over = {subject: self._counts.pop(subject) for subject, at_s in self._over_s.items() if at_s <= now_s}
        self._over_s = {subject: at_s for subject, at_s in self._over_s.items() if subject not in over}
        return over

    def forget(self, subject: str) -> None:
        """Forget the trouble of a subject that is another one from now on."""
        self._counts.pop(subject, None)
        self._over_s.pop(subject, None)
