"""The log keeps events and actions, and each filter passes exactly its matches."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import ComponentState, LifeState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.mission_log.lines import log_json, log_lines
from backbone.mission_log.log import FOR_EVER_S, AskLog, Log, LogKeeper, MissionLog
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.moments import Now
from backbone.ranges import A_DAY_S
from backbone.wire import MAX_MESSAGE_BYTES, WIRE_VERSION, Envelope, write

CONSOLE = "ui_console/console-7"
NOW = Now(100.0, datetime(2026, 5, 4, 14, 10))


def event(at_s: float, subject: str, what: str, level: LogLevel = LogLevel.INFO, user: str = "") -> StoryEvent:
    return StoryEvent(at_s, CONSOLE, what, subject, "", level, user)


DROVE = OperatorActed("anna", OperatorAction.DRIVE_BEGIN, "scout2", "left +4.0, right +4.0 rad/s", 10.0).event(CONSOLE)
STOPPED = OperatorActed("ben", OperatorAction.STOP_ROBOT, "scout1", "child in the room", 20.0).event(CONSOLE)
FELL = event(30.0, "scout2", "fell, killed by SIGKILL; restarts in 0.05 s", LogLevel.WARNING)
TAKEN = event(40.0, "scout10", "was taken over by anna", LogLevel.NOTICE)
ALL = [DROVE, STOPPED, FELL, TAKEN]


def answer(**asked: Any) -> list[StoryEvent]:
    log = MissionLog()
    for one in ALL:
        log.add(one)
    return log.answer(AskLog(**asked)).events


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ({}, ALL),
        ({"since_s": 20.0, "until_s": 30.0}, [STOPPED, FELL]),
        ({"robot": "scout2"}, [DROVE, FELL]),
        ({"robot": "scout1"}, [STOPPED]),
        ({"person": "Anna"}, [DROVE, TAKEN]),
        ({"level": LogLevel.WARNING}, [STOPPED, FELL]),
        ({"level": LogLevel.ALARM}, [STOPPED]),
        ({"text": "CHILD"}, [STOPPED]),
        ({"robot": "scout2", "person": "anna", "until_s": 15.0}, [DROVE]),
        ({"person": "eve"}, []),
        ({"most": 1}, [TAKEN]),
    ],
)
def test_who_moved_a_robot_when_and_what_went_wrong_is_found(asked: dict[str, Any], found: list[StoryEvent]) -> None:
    assert answer(**asked) == found


def test_what_is_left_out_and_what_is_not_kept_any_more_is_told() -> None:
    log = MissionLog(kept=3)
    for one in ALL:
        log.add(one)
    assert log.answer(AskLog(most=2)) == Log([FELL, TAKEN], left_out=1, since_s=20.0)


@given(st.lists(st.tuples(st.floats(0, 100), st.sampled_from(list(LogLevel))), max_size=30), st.integers(1, 10))
def test_the_newest_that_fit_are_told_oldest_first(events: list[tuple[float, LogLevel]], most: int) -> None:
    log = MissionLog()
    for at_s, level in events:
        log.add(event(at_s, "scout1", "happened", level))
    found = log.answer(AskLog(level=LogLevel.NOTICE, most=most))
    fitting = sorted(at_s for at_s, level in events if level is not LogLevel.INFO)
    assert [one.at_s for one in found.events] == fitting[-most:]
    assert found.left_out == max(0, len(fitting) - most)


def test_an_answer_fits_one_message_however_long_the_texts_are() -> None:
    log, count = MissionLog(), 2_000
    for at_s in range(count):
        log.add(event(at_s, "talker", "ö" * 5_000))
    found = log.answer(AskLog())
    assert len(write(Envelope(WIRE_VERSION, "backbone/launcher", 1, 0.0, "", found))) < MAX_MESSAGE_BYTES
    assert len(found.events) + found.left_out == count
    assert len(found.events) > 100
    assert [one.at_s for one in found.events] == [float(at_s) for at_s in range(found.left_out, count)]


def test_the_keeper_hears_components_and_people_and_calls_people_by_their_names() -> None:
    async def main() -> None:
        network = LocalNetwork("m")
        keeper = LogKeeper(network.join("backbone/launcher", VirtualClock()))
        console = network.join(CONSOLE, VirtualClock())
        arc = network.join("resource_pool/console-7-drive", VirtualClock())
        sits = ComponentState(CONSOLE, "console", "base", 7, LifeState.READY, 0.0, user="Anna B.")
        arc.publish(arc.source, Conversation.LOG, event(1.0, "console-7-drive", "took it from console-7"))
        console.publish(CONSOLE, Conversation.STATUS, sits)
        acted = OperatorActed("Anna B.", OperatorAction.STOP_ROBOT, "scout1", "", 2.0)
        console.publish(CONSOLE, Conversation.OPERATORS, acted)
        await VirtualClock().sleep_s(0.1)
        first, second = keeper.log.answer(AskLog()).events
        assert (first.subject, first.what) == ("Anna B.", "took it from Anna B.")
        assert (second.subject, second.user, second.level) == ("scout1", "Anna B.", LogLevel.ALARM)
        assert keeper.log.answer(AskLog(person="anna b.", level=LogLevel.ALARM)).events == [second]

    run_virtual(main())


def test_a_line_has_the_time_of_day_the_mission_time_and_what_happened() -> None:
    [line] = log_lines(Log([STOPPED]), NOW)
    assert " ".join(line.split()) == "14:08:40 20.00 s !! scout1 ben stops it: child in the room"


@given(st.floats(-A_DAY_S, FOR_EVER_S), st.floats(0, 1_000, exclude_min=True))
@example(FOR_EVER_S, 1.0)
def test_an_event_of_any_time_that_a_message_carries_has_a_line(at_s: float, rate: float) -> None:
    log, now = Log([event(at_s, "scout1", "happened")]), Now(100.0, NOW.here, rate)
    assert [line.endswith("happened") for line in log_lines(log, now)] == [True]
    assert json.loads(json.dumps(log_json(log, now)))["events"][0]["at_s"] == at_s


def test_an_export_is_one_object_with_everything_in_it() -> None:
    plain = json.loads(json.dumps(log_json(Log(ALL, 3, 1.0), NOW)))
    assert (plain["left_out"], plain["since_s"], len(plain["events"])) == (3, 1.0, 4)
    assert {"at_s", "time", "level", "subject", "what", "person", "where", "cause"} == plain["events"][0].keys()
    assert plain["events"][1]["person"] == "ben"
    assert plain["events"][1]["time"].startswith("2026-05-04T14:08:40.000")
