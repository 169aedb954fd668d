"""Keys that answer questions: held or pressed twice, they answer no later question."""

from __future__ import annotations

import pytest

from ui_console.model.answering import AWAKE_EVERY_S, AnswerGrip
from ui_console.model.driving import KEYS_LET_GO_S

REPEAT_S = 0.03


class Screen:
    """A console that reads an answer key."""

    def __init__(self, question: int) -> None:
        self.grip, self.now_s = AnswerGrip(), 0.0
        self.ask(question)

    def ask(self, question: int) -> None:
        self.grip.show(question, self.now_s)

    def press(self) -> int:
        return self.grip.press(self.now_s, self.now_s)

    def hold(self, for_s: float) -> list[int]:
        """Return the questions that the key answers which repeats for so long."""
        answered = []
        for _repeat in range(round(for_s / REPEAT_S)):
            answered.append(self.press())
            self.now_s += REPEAT_S
        return [question for question in answered if question]

    def wait(self, for_s: float) -> None:
        for _look in range(round(for_s / AWAKE_EVERY_S)):
            self.now_s += AWAKE_EVERY_S
            self.grip.look(self.now_s)


def test_a_key_that_is_held_answers_no_question_that_comes_meanwhile() -> None:
    on = Screen(question=0)
    assert not on.hold(0.3)
    on.ask(1)
    assert not on.hold(3.0)
    on.wait(KEYS_LET_GO_S + AWAKE_EVERY_S)
    assert on.press() == 1


def test_a_fresh_press_answers_each_question() -> None:
    on = Screen(question=1)
    assert on.press() == 1
    on.ask(2)
    on.wait(0.2)
    assert not on.press(), "a double press"
    on.wait(0.8)
    assert on.press() == 2
    on.ask(3)
    on.wait(9.0)
    assert on.press() == 3


def test_a_key_that_was_pressed_before_the_question_came_to_the_screen_does_not_answer_it() -> None:
    on = Screen(question=1)
    on.wait(5.0)
    pressed_s, on.now_s = on.now_s, on.now_s + 0.05
    on.ask(2)
    assert not on.grip.press(pressed_s, on.now_s)


@pytest.mark.parametrize("for_s", [0.2, 1.0, 60.0])
def test_a_key_held_while_the_console_stands_still_answers_no_question_that_came_meanwhile(for_s: float) -> None:
    on = Screen(question=0)
    on.hold(1.0)
    for question in (1, 2, 3):
        on.now_s += for_s
        on.ask(question)
        assert not on.hold(0.5)
    on.wait(KEYS_LET_GO_S + AWAKE_EVERY_S)
    assert on.press() == 3
