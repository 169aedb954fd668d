"""What screens show follows from what was heard."""

import json

import pytest

from backbone.component.messages import StoryEvent
from backbone.rc_manager.messages import Holder, RcView, RequestState, RequestView, Schedule, Why
from ui_console.console_model import (
    Asked,
    CommandApplied,
    CommandRefused,
    ConsoleEvent,
    ConsoleModel,
    GivenBack,
    Granted,
    LinkTrouble,
    Lost,
    PictureSeen,
    ScheduleHeard,
    StoryHeard,
    WhyHeard,
    event_json,
)

GRANT = Granted(10.0, {"scout": "scout1", "command_radio": "radio"}, {"scout1": 7, "radio": 3}, 15.0, 9.95, False)
ASK = Asked(9.95, "scout1", "capture", 100)


def request(arc: str, owner: str, state: RequestState, until_s: float, expected_s: float) -> RequestView:
    return RequestView(
        arc, owner, state, ["scout1"], 5.0, until_s, expected_s, "its turn", [], 5.0, "iros2001:10/watch1:3", 4
    )


SCHEDULE = Schedule(
    8.0,
    [
        RcView("scout2", "scout", "free", False, 1.0, [], 0, []),
        RcView(
            "scout1", "scout", "held", False, 1.0, [Holder("watch1-capture", 6, 5.0, 10.0)], 6, ["console-1-capture"]
        ),
        RcView("radio", "command_radio", "held", True, 1.0, [], 0, []),
    ],
    [
        request("watch1-capture", "mission_control/watch1", RequestState.RUNNING, 10.0, -1.0),
        request("console-1-capture", "ui_console/console-1", RequestState.WAITING, -1.0, 12.0),
    ],
    [],
)


def model(*events: ConsoleEvent) -> ConsoleModel:
    made = ConsoleModel("console-1")
    for event in events:
        made.apply(event)
    return made


def test_the_robot_table_says_who_holds_what_since_when_until_when_and_who_waits() -> None:
    rows = model(ScheduleHeard(8.0, SCHEDULE)).robots()
    assert [row.robot for row in rows] == ["scout1", "scout2"]
    held, free = rows
    assert (held.holder, held.priority, held.since_s, held.until_s) == ("watch1", "iros2001:10/watch1:3", 5.0, 10.0)
    assert held.waiting == ("console-1",)
    assert free.holder == ""


def test_the_schedule_shows_running_first_with_what_is_left_and_waiting_with_when() -> None:
    lines = model(ScheduleHeard(8.0, SCHEDULE)).schedule_lines(8.0)
    assert lines == ["watch1:  2.0 s left; its turn", "console-1: in  4.0 s; its turn"]


def test_the_status_line_follows_a_take_over_from_wish_to_release() -> None:
    shown = model()
    assert shown.status_line(9.0) == "watching; you hold no robot"
    shown.apply(ASK)
    assert shown.status_line(9.96) == "waiting for scout1"
    shown.apply(WhyHeard(9.97, Why("c", "waiting", ["watch1 has its minimum run time"], "R5", [], 12.0, "")))
    assert shown.status_line(9.97) == "waiting for scout1: watch1 has its minimum run time"
    shown.apply(GRANT)
    assert shown.status_line(11.0) == "you hold scout1 (epoch 7), slice 4 s"
    shown.apply(Lost(12.0, "higher", "console-2", -1.0))
    assert shown.status_line(12.0) == "waiting for scout1: higher by console-2"
    shown.apply(GivenBack(13.0, "released", True))
    assert shown.status_line(13.0) == "watching; you hold no robot"


def test_a_picture_says_how_old_it_is() -> None:
    assert model().video_line(5.0) == "no picture yet"
    assert model(PictureSeen(5.1, 5.0, "scout1")).video_line(6.5) == "scout1: picture 1.5 s old"


def test_alarms_are_told_newest_first_and_repeats_once() -> None:
    refused = CommandRefused(3.0, "arc.swapped_out", "holds nothing", "wait")
    shown = model(*[refused] * 20, LinkTrouble(4.0, "nobody"), StoryHeard(5.0, StoryEvent(5.0, "a/b", "fell", "b", "")))
    assert [line.split("s  ")[1] for line in shown.alarm_lines(10)] == [
        "b: fell",
        "no answer: nobody",
        "refused: holds nothing (wait)",
    ]
    assert shown.alarm_lines(0) == []


@pytest.mark.parametrize(
    ("event", "word", "fields"),
    [
        (GRANT, "granted", {"epochs": {"scout1": 7, "radio": 3}, "asked_s": 9.95, "at_s": 10.0}),
        (Lost(1.0, "higher", "console-2", -1.0), "suspended", {"reason": "higher", "by": "console-2"}),
        (Granted(1.0, {}, {}, 2.0, 0.0, True), "resumed", {"until_s": 2.0}),
        (CommandApplied(1.0, "scout1", 7, "drive", {"left_rad_s": 4.0}), "applied", {"epoch": 7, "rc": "scout1"}),
        (CommandRefused(1.0, "a.b", "no", "ask later"), "refused", {"code": "a.b", "remedy": "ask later"}),
        (GivenBack(1.0, "released", True), "released", {"confirmed": True}),
        (ScheduleHeard(8.0, SCHEDULE), "schedule", {"at_s": 8.0}),
    ],
)
def test_events_are_json_lines_with_their_words(event: ConsoleEvent, word: str, fields: dict[str, object]) -> None:
    line = json.loads(event_json(event))
    assert line["event"] == word
    assert {name: line[name] for name in fields} == fields


def test_a_schedule_in_json_names_its_fields() -> None:
    line = json.loads(event_json(ScheduleHeard(8.0, SCHEDULE)))
    assert line["schedule"]["rcs"][1]["holders"][0]["arc"] == "watch1-capture"
