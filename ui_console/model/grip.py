"""State of one control: held or not, and let go or not since that was required.

Rules of this file: no bus, no clock; times are seconds of the machine.

After a stop, a cut link or a change of holder a control that is still held must not move anything: only an operator who
let go and presses anew reacts to the present situation. Keys report presses only, so a pause shows their release;
sticks, pads and pages report it.
"""

from __future__ import annotations

import math


class ControlGrip:
    """One control of an operator.

    Laws: after ``require_let_go`` no press counts until the control was let go; the release is reported, or is a
    silence as long as the last press lasts.
    """

    def __init__(self) -> None:
        self._until_s = -math.inf
        self._waits = False

    def require_let_go(self) -> None:
        """Ignore presses until the control was let go."""
        self._waits = True

    def let_go(self) -> None:
        """Take in the release of the control: the next press counts, unless a release is required anew.

        A control that was held a moment ago may still be held when a release is required right afterwards: screens also
        report a release for other reasons.
        """
        self._waits = False

    def press(self, now_s: float, lasts_s: float) -> bool:
        """Take in that the control is held, for the first time or still; return whether that counts.

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
        """Return whether the control is held and has to be let go before it counts."""
        return self._waits and now_s < self._until_s

    @property
    def let_go_s(self) -> float | None:
        """When a control that is held back counts as let go if no press follows; None: it is not held back."""
        return self._until_s if self._waits and self._until_s > -math.inf else None
