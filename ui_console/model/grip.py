"""State of one control: whether it is held, and whether it was released since a release was required.

Rules of this file: no bus, no clock; times are seconds of the machine.

After a stop, a cut link or a change of holder, a control that is still held must not move anything: only an operator
who releases it and presses again reacts to the present situation. Keys report only presses, so a pause shows their
release; sticks, pads and pages report the release.
"""

from __future__ import annotations

import math


class ControlGrip:
    """A control of an operator.

    Laws: after ``require_let_go`` no press counts until the control was released. A release is reported, or follows
    from a silence longer than the last press lasts. A time in which no press was read is no silence.
    """

    def __init__(self) -> None:
        self._until_s = -math.inf
        self._waits = False

    def require_let_go(self) -> None:
        """Ignore presses until the control was released."""
        self._waits = True

    def let_go(self) -> None:
        """Record the release of the control: the next press counts, unless a release is required again.

        Screens also report a release for other reasons. So if a release is required right afterwards, the control
        counts as still held.
        """
        self._waits = False

    def press(self, now_s: float, lasts_s: float) -> bool:
        """Record that the control is held, for the first time or still; return whether the press counts.

        Args:
            now_s: Machine time of the press.
            lasts_s: Silence after which the control counts as released.
        """
        counts = not self.is_held_back(now_s)
        self._until_s = now_s + lasts_s
        if counts:
            self._waits = False
        return counts

    def stood_still(self, for_s: float) -> None:
        """Record that presses were not read for this time: it is no silence of the control."""
        if self._waits:
            self._until_s += for_s

    def is_held_back(self, now_s: float) -> bool:
        """Return whether the control is held and must be released before it counts."""
        return self._waits and now_s < self._until_s

    @property
    def let_go_s(self) -> float | None:
        """Time at which a held-back control counts as released if no press follows; None: it is not held back."""
        return self._until_s if self._waits and self._until_s > -math.inf else None
