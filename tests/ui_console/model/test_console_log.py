"""The log of a console begins with what happened before, has everything once, and is searched as the command does."""

from __future__ import annotations

from typing import Any

import pytest
from console_scenes import model
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import LogLevel, StoryEvent
from backbone.mission_log.log import AskLog, Log, PeopleKnown
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.picture.mission import LOG_KEPT
from ui_console.model.events import Heard

CONSOLE = "ui_console/console-9"
DROVE = OperatorActed("ben", OperatorAction.DRIVE_BEGIN, "scout2", "left +4.0, right +4.0 rad/s", 10.0)
STOPPED = OperatorActed("ben", OperatorAction.STOP_ROBOT, "scout1", "child in the room", 20.0)
FELL = StoryEvent(30.0, "backbone/creator-base", "fell, killed by SIGKILL", "scout2", "", LogLevel.WARNING)


def event(at_s: float) -> StoryEvent:
    return StoryEvent(at_s, "backbone/launcher", f"happened at {at_s}", "scout1", "")


def test_what_happened_before_the_console_came_is_in_its_log_under_the_names_of_people() -> None:
    taken = StoryEvent(5.0, CONSOLE, "was taken over by console-9", "scout2", "")
    shown = model(Heard(40.0, PeopleKnown({"console-9": "ben"})), Heard(40.0, Log([taken, DROVE.event(CONSOLE)])))
    assert [(row.at_s, row.what) for row in shown.log()] == [
        (5.0, "was taken over by ben"),
        (10.0, "is driven by ben: left +4.0, right +4.0 rad/s"),
    ]


@given(st.lists(st.integers(0, 60), unique=True), st.lists(st.integers(0, 60), unique=True))
def test_what_is_told_and_heard_is_in_the_log_once_and_in_order(told: list[int], heard: list[int]) -> None:
    shown = model(*[Heard(70.0, event(float(at_s))) for at_s in heard])
    shown.apply(Heard(70.0, Log([event(float(at_s)) for at_s in sorted(told)])))
    assert [row.at_s for row in shown.team.log(LOG_KEPT)] == sorted({*told, *heard})


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ({"robot": "scout2"}, [10.0, 30.0]),
        ({"person": "Ben"}, [10.0, 20.0]),
        ({"level": LogLevel.WARNING}, [20.0, 30.0]),
        ({"text": "child"}, [20.0]),
        ({"robot": "scout2", "until_s": 15.0}, [10.0]),
    ],
)
def test_the_table_is_searched_as_the_command_searches(asked: dict[str, Any], found: list[float]) -> None:
    shown = model(Heard(10.0, DROVE, CONSOLE), Heard(20.0, STOPPED, CONSOLE), Heard(30.0, FELL))
    assert [row.at_s for row in shown.team.log(asked=AskLog(**asked))] == found


def test_a_row_says_how_much_it_matters_and_who_did_it() -> None:
    [row] = model(Heard(20.0, STOPPED, CONSOLE)).log()
    assert (row.level, row.user) == ("alarm", "ben")


@given(st.lists(st.integers(0, 30), unique=True), st.lists(st.integers(0, 30), unique=True), st.integers(0, 40))
def test_what_was_found_is_followed_by_what_was_heard_since_once_and_in_order(
    found: list[int], heard: list[int], count: int
) -> None:
    shown = model(*[Heard(70.0, event(float(at_s))) for at_s in heard])
    rows = shown.team.log(count, AskLog(), [event(float(at_s)) for at_s in sorted(found)])
    since = max(found, default=0)
    wanted = sorted({*found, *(at_s for at_s in heard if at_s >= since)})
    assert [row.at_s for row in rows] == (wanted[-count:] if count else [])
