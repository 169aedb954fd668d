"""Keys by which a person answers the questions of other operators.

Rules of this file: no bus, no clock, no screen; times are seconds of the machine.
"""

from __future__ import annotations

import math

from ui_console.model.driving import KEYS_LET_GO_S

AWAKE_EVERY_S = 0.1  # chosen: a process that stands still for less than that loses no press


class AnswerGrip:
    """The keys that answer questions of other operators.

    Law: a key answers the question on the screen only if it was pressed after the question came there. A key that is
    held since before, or pressed again at once, answers none, also if the console stood still meanwhile.
    """

    def __init__(self) -> None:
        self._question, self._shown_s = 0, math.inf
        self._let_go_s, self._looked_s = -math.inf, math.inf

    def show(self, question: int, now_s: float) -> None:
        """Record the number of the question on the screen; 0: none."""
        if question != self._question:
            self._question, self._shown_s = question, now_s

    def look(self, now_s: float) -> None:
        """Record that the console reads keys; call it every ``AWAKE_EVERY_S``: a longer time is no silence of a key."""
        if self._looked_s < self._let_go_s:
            self._let_go_s += max(0.0, now_s - self._looked_s - AWAKE_EVERY_S)
        self._looked_s = now_s

    def press(self, pressed_s: float, now_s: float) -> int:
        """Record that such a key is down, for the first time or repeated; return the question it answers, 0: none.

        Args:
            pressed_s: When the key was read.
            now_s: Now, which is later if the console was busy.
        """
        self.look(now_s)
        is_fresh = pressed_s >= max(self._let_go_s, self._shown_s)
        self._let_go_s = now_s + KEYS_LET_GO_S
        return self._question if is_fresh else 0
