"""What is typed to search the log."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import LogLevel
from backbone.mission_log import AskLog
from ui_console.terminal.log_search import WrongSearch, read_search


@pytest.mark.parametrize(
    ("line", "asked"),
    [
        ("", None),
        ("  ", None),
        ("was stopped", AskLog(text="was stopped")),
        ("robot:scout1", AskLog(robot="scout1")),
        ("person:anna level:alarm", AskLog(person="anna", level=LogLevel.ALARM)),
        ("since:12.5 smoke", AskLog(since_s=12.5, text="smoke")),
        ("time:12", AskLog(text="time:12")),
        ("robot:", AskLog(text="robot:")),
    ],
)
def test_words_are_a_text_and_fields_have_names(line: str, asked: AskLog | None) -> None:
    assert read_search(line) == asked


@pytest.mark.parametrize("line", ["level:loud", "since:soon", "since:nan", "text" * 5000])
def test_what_cannot_be_asked_is_refused_with_what_can(line: str) -> None:
    with pytest.raises(WrongSearch) as wrong:
        read_search(line)
    assert "level:alarm" in wrong.value.remedy


@given(st.text(max_size=60))
def test_any_line_is_a_question_or_refused(line: str) -> None:
    try:
        asked = read_search(line)
    except WrongSearch:
        return
    assert asked is None or isinstance(asked, AskLog)
