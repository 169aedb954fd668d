"""Whether one control is held, and whether it was let go since that was required.

Rules of this file: no bus, no clock; times are seconds of the machine.

After a stop, a cut link or a change of holder a control that is still held must not move anything: only a hand that let
go and presses anew means what happens now. Keys tell presses only, so a pause is what shows that they were let go;
sticks, pads and pages also say it.
"""

from __future__ import annotations

import math


class Grip:
    """One control of an operator.

    Laws: after ``require_let_go`` no press counts until the control was let go; being let go is told, or is a silence
    as long as the last press lasts.
    """

    def __init__(self) -> None:
        self._until_s = -math.inf
        self._waits = False

    def require_let_go(self) -> None:
        """From now on presses count for nothing until the control was let go."""
        self._waits = True

    def let_go(self) -> None:
        """The control says that it is held no longer: the next press counts, unless that is required anew.

        What was held a moment ago may still be when it is required right afterwards: screens say so for other reasons.
        """
        self._waits = False

    def press(self, now_s: float, lasts_s: float) -> bool:
        """The control is held, for the first time or still; return whether that counts.

        Args:
            now_s: When.
            lasts_s: A silence as long as this shows that it was let go.
        """
        counts = not self.is_held_back(now_s)
        self._until_s = now_s + lasts_s
        if counts:
            self._waits = False
        return counts

    def is_held_back(self, now_s: float) -> bool:
        """Return whether it is held and has to be let go before it counts."""
        return self._waits and now_s < self._until_s

    @property
    def let_go_s(self) -> float | None:
        """When a control that is held back counts as let go if nothing more is heard of it; None: none is."""
        return self._until_s if self._waits and self._until_s > -math.inf else None
