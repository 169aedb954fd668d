"""Keys that answer questions: held or pressed twice, they answer no later question."""

from __future__ import annotations

from ui_console.model.answering import AnswerGrip
from ui_console.model.driving import KEYS_LET_GO_S

REPEAT_S = 0.03


def test_a_key_that_is_held_answers_no_question_that_comes_meanwhile() -> None:
    grip = AnswerGrip()
    times = [(REPEAT_S * count, 0 if count < 10 else 1) for count in range(40)]
    assert not any(grip.press(question, at_s) for at_s, question in times)
    assert grip.press(1, times[-1][0] + KEYS_LET_GO_S + REPEAT_S)


def test_a_fresh_press_answers_each_question() -> None:
    grip = AnswerGrip()
    assert grip.press(1, 0.0)
    assert not grip.press(2, 0.2), "a double press"
    assert grip.press(2, 1.0)
    assert grip.press(3, 9.0)
