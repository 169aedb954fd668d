"""Text from the bus commands no terminal, browser or log."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import Absence, ComponentState, LifeState
from backbone.printable import printable_all
from backbone.printable_text import MOST_CHARACTERS, printable, printable_lines

HOSTILE = [
    "\x1b]0;owned\x07",
    "\x1b[2J\x1b[H all is well",
    "down\rup",
    "\x9b2J",
    "\u202eevil\u2066",
    "\udc80",
    "one\ntwo",
    "x" * 1_000_000,
    "\x1b" * 1_000_000,
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_text_is_one_printable_line_of_bounded_length(text: str) -> None:
    shown = printable(text)
    assert shown.isprintable()
    assert len(shown) < 10 * MOST_CHARACTERS
    shown.encode()


@given(st.text(st.characters(exclude_categories=[])))
def test_whatever_comes_is_printable(text: str) -> None:
    assert printable(text).isprintable()
    assert all(line.isprintable() for line in printable_lines(text).split("\n"))


@given(st.text(st.characters(categories=["L", "N", "P", "S"]), max_size=MOST_CHARACTERS))
def test_an_honest_text_stays_as_it_is(text: str) -> None:
    assert printable(text) == text == printable_lines(text)


def test_every_text_within_a_message_is_printable_afterwards() -> None:
    lacking = Absence("a\x1b[2J", 1.0, "b\r", vital=True)
    state = ComponentState("x/y\x07", "t", "h", 4711, LifeState.READY, 0.5, "\u202efine", absent=[lacking])
    clean = printable_all({"x\x1b": state})
    assert list(clean) == ["x\\x1b"]
    shown = clean["x\\x1b"]
    assert (shown.address, shown.feedback) == ("x/y\\x07", "\\u202efine")
    assert shown.absent == [Absence("a\\x1b[2J", 1.0, "b\\r", vital=True)]
    assert shown.state is LifeState.READY
    assert shown.pid == 4711


def test_a_message_that_is_printable_is_handed_on_as_it_is() -> None:
    state = ComponentState("x/y", "t", "h", 4711, LifeState.READY, 0.5, "fine", absent=[Absence("a", 1.0, "b")])
    assert printable_all(state) is state
