"""Keys by which a person answers the questions of other operators.

Rules of this file: no bus, no clock, no screen; times are seconds of the machine.
"""

from __future__ import annotations

from ui_console.model.driving import KEYS_LET_GO_S
from ui_console.model.grip import ControlGrip


class AnswerGrip:
    """The keys that answer questions of other operators.

    Law: a key that is held while another question comes to the screen, or the first one, does not answer it.
    """

    def __init__(self) -> None:
        self._keys, self._question = ControlGrip(), 0

    def press(self, question: int, now_s: float) -> bool:
        """Record that such a key is down, for the first time or repeated; return whether it answers the question.

        Args:
            question: Number of the question on the screen; 0: none.
            now_s: Machine time of the press.
        """
        if question != self._question:
            self._question = question
            self._keys.require_let_go()
        return self._keys.press(now_s, KEYS_LET_GO_S) and question > 0
