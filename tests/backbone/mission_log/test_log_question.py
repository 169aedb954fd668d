"""Any typed question to the log becomes a valid question to the launcher, or a typed refusal."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import LogLevel
from backbone.errors import Refusal
from backbone.mission_log.log import FOR_EVER_S, MOST_EVENTS, AskLog
from backbone.mission_log.question import LONGEST_WORDS, LogQuestion, WrongSearch
from backbone.moments import NoMoment, Now

NOW = Now(1000.0, datetime(2026, 5, 4, 14, 10, 30), rate=2.0)
ODD = ["9" * 400, "99999d", "5m", "14:05", "alarm", "٣", "x" * 5000, "\0", "[a-z"]
typed = st.text(st.characters(codec="utf-8"), max_size=400) | st.sampled_from(ODD)


@given(st.fixed_dictionaries({}, optional=dict.fromkeys(LogQuestion.__struct_fields__, typed)))
def test_whatever_is_typed_the_question_has_the_limits_of_the_bus_or_is_refused(fields: dict[str, str]) -> None:
    try:
        asked = LogQuestion(**fields).asked(NOW)
    except (WrongSearch, NoMoment):
        return
    assert msgspec.convert(msgspec.to_builtins(asked), AskLog) == asked
    assert 0 <= asked.since_s <= asked.until_s <= FOR_EVER_S
    assert asked.most == MOST_EVENTS


@pytest.mark.parametrize(
    ("fields", "asked"),
    [
        ({}, {}),
        ({"text": "  was \n stopped "}, {"text": "was stopped"}),
        ({"robot": "scout1", "level": "alarm"}, {"robot": "scout1", "level": LogLevel.ALARM}),
        ({"since": "1m", "until": "10s"}, {"since_s": 880.0, "until_s": 980.0}),
        ({"since": "14:10"}, {"since_s": 940.0}),
        ({"since": "9h"}, {"since_s": 0.0}),
        ({"since": "9" * 400}, {"since_s": FOR_EVER_S}),
    ],
)
def test_a_question_means_what_it_says(fields: dict[str, str], asked: dict[str, Any]) -> None:
    assert LogQuestion(**fields).asked(NOW) == AskLog(**asked)


@pytest.mark.parametrize(
    ("fields", "code", "words"),
    [
        ({"level": "loud"}, WrongSearch.code, "no level 'loud'"),
        ({"text": "x" * (LONGEST_WORDS + 1)}, WrongSearch.code, "201 characters"),
        ({"person": "x" * 300}, WrongSearch.code, "person has 300"),
        ({"since": "1m", "until": "2m"}, WrongSearch.code, "comes after"),
        ({"since": "soon"}, NoMoment.code, "'soon' is no moment"),
    ],
)
def test_a_field_that_cannot_be_is_refused_by_name(fields: dict[str, str], code: str, words: str) -> None:
    with pytest.raises(Refusal, match=words) as refused:
        LogQuestion(**fields).asked(NOW)
    assert refused.value.code == code
