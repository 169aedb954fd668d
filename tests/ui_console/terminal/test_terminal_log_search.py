"""What is typed to search the log, and what stands over what was found."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import StoryEvent
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from ui_console.terminal.log_search import FOUND_SHOWN, LogResult, read_search


@pytest.mark.parametrize(
    ("line", "asked"),
    [
        ("", None),
        ("  ", None),
        ("was stopped", LogQuestion("was stopped")),
        ("robot:scout1", LogQuestion(robot="scout1")),
        ("person:anna level:alarm", LogQuestion(person="anna", level="alarm")),
        ("since:12.5 smoke until:14:05", LogQuestion("smoke", since="12.5", until="14:05")),
        ("time:12", LogQuestion("time:12")),
        ("text:12", LogQuestion("text:12")),
        ("robot:", LogQuestion("robot:")),
    ],
)
def test_words_are_a_text_and_fields_have_names(line: str, asked: LogQuestion | None) -> None:
    assert read_search(line) == asked


@given(st.text(max_size=60))
def test_any_line_is_a_question_or_none(line: str) -> None:
    assert (read_search(line) is None) is (not line.split())


def test_the_title_says_how_much_was_found_and_how_much_of_it_is_shown() -> None:
    few = Log([StoryEvent(1.0, "backbone/launcher", "began", "mission", "")])
    many = Log(few.events, left_out=4000)
    assert LogResult("began", AskLog(), few).title == "log: began (1 event)"
    assert LogResult("began", AskLog(), many).title == f"log: began (4001 events, the newest {FOUND_SHOWN})"
