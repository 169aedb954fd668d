"""What a person writes to be injected is read as it stands, or refused with how to write it."""

from __future__ import annotations

import pytest

from backbone.command_line.injecting import read_object
from backbone.command_line.options import json_or_text
from backbone.component.messages import SetParameter
from backbone.recording.revival import WRITE_ONE, OtherForm, message_from
from backbone.wire import schema_of

CLASSES = {schema_of(SetParameter): SetParameter}
DEEP = "[" * 10_000 + "]" * 10_000


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no JSON"),
        ("{'schema': 1}", "no JSON"),
        (DEEP, "no JSON"),
        ('{"schema": "AskState", "schema": "Stop"}', "twice"),
        ('{"schema": "SetParameter", "deep": {"a": 1, "a": 2}}', "twice"),
        ('{"schema": "SetParameter", "name": "limit", "value": NaN}', "NaN"),
        ('{"schema": "SetParameter", "name": "limit", "value": [-Infinity]}', "-Infinity"),
        ('{"schema": "SetParameter", "name": "limit", "value": 1e999}', "1e999"),
    ],
    ids=["nothing", "Python", "deep", "twice", "twice within", "no number", "no end", "too large"],
)
def test_what_is_no_json_is_refused_with_how_to_write_it(text: str, told: str) -> None:
    with pytest.raises(OtherForm, match=told) as refused:
        read_object(text)
    assert refused.value.remedy == WRITE_ONE


@pytest.mark.parametrize("said", [{}, {"name": 5}, {"name": "x", "value": None, "user": "a" * 10_000}], ids=str)
def test_a_message_with_other_values_is_refused_with_how_to_write_it(said: dict[str, object]) -> None:
    with pytest.raises(OtherForm, match="SetParameter/") as refused:
        message_from(CLASSES, {"schema": "SetParameter"} | said)
    assert refused.value.remedy == WRITE_ONE


@pytest.mark.parametrize("text", [DEEP, "9" * 5000], ids=["deep", "many digits"])
def test_a_value_that_is_too_much_to_be_json_is_a_text(text: str) -> None:
    assert json_or_text(text) == text
