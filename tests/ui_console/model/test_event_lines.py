"""Events of a console as JSON lines."""

from __future__ import annotations

import json

import pytest
from console_scenes import (
    EVENTS,
    GRANT,
    SCHEDULE,
    STOP,
)

from resource_pool.arc_client import Suspended
from ui_console.model.events import (
    CommandApplied,
    CommandRefused,
    ConsoleEvent,
    GivenBack,
    Granted,
    Heard,
    event_json,
)


@pytest.mark.parametrize(
    ("event", "word", "fields"),
    [
        (GRANT, "granted", {"epochs": {"scout1": 7, "radio": 3}, "asked_s": 9.95, "at_s": 10.0}),
        (
            Heard(1.0, Suspended("arc", "higher", "console-2", -1.0)),
            "suspended",
            {"reason": "higher", "by": "console-2"},
        ),
        (Granted(1.0, "", {}, {}, 2.0, 0.0, True), "resumed", {"until_s": 2.0}),
        (CommandApplied(1.0, "scout1", 7, "drive", {"left_rad_s": 4.0}), "applied", {"epoch": 7, "rc": "scout1"}),
        (CommandRefused(1.0, "a.b", "no", "ask later"), "refused", {"code": "a.b", "remedy": "ask later"}),
        (GivenBack(1.0, "released", True), "released", {"confirmed": True}),
        (Heard(8.0, SCHEDULE), "schedule", {"at_s": 8.0}),
        (Heard(8.0, STOP), "stop", {"at_s": 8.0}),
    ],
)
def test_events_are_json_lines_with_their_words(event: ConsoleEvent, word: str, fields: dict[str, object]) -> None:
    line = json.loads(event_json(event))
    assert line["event"] == word
    assert {name: line[name] for name in fields} == fields


@pytest.mark.parametrize("event", EVENTS, ids=[type(event).__name__ for event in EVENTS])
def test_every_event_has_a_word(event: ConsoleEvent) -> None:
    assert json.loads(event_json(event))["event"]


def test_a_schedule_in_json_names_its_fields() -> None:
    line = json.loads(event_json(Heard(8.0, SCHEDULE)))
    assert line["schedule"]["rcs"][1]["holders"][0]["arc"] == "watch1-capture"
