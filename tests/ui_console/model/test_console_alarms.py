"""Alarms are few: an ended condition is none, an event fades, one cause is one line, and no operator misses any."""

from __future__ import annotations

import msgspec
import pytest
from console_scenes import ASK, GRANT, STOP, TEAM_EVENTS, component, model, rc, request
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import Absence
from backbone.creator.messages import ProcessFell
from backbone.nameserver.messages import Disappeared
from backbone.picture.health import HealthWord, MissionHealth
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import Schedule
from resource_pool.arc_client import Suspended
from ui_console.model.alarms import ALARMS_KEPT, FADES_AFTER_S, AlarmBook, alarm_key, one_line_for_one_cause
from ui_console.model.events import CommandRefused, ConsoleEvent, GivenBack, Granted, Heard, LinkTrouble
from ui_console.model.views import AlarmKind, AlarmView, Severity

KIND = AlarmKind.LOST
STEPS = st.lists(
    st.tuples(st.sampled_from(["happened", "begin", "end", "acknowledge"]), st.integers(0, 5)), max_size=60
)


def play(steps: list[tuple[str, int]]) -> tuple[AlarmBook, set[str], set[str]]:
    """Return the book, the unseen alarms by the plain rule, and the present conditions."""
    book, unseen, active = AlarmBook(), set[str](), set[str]()
    for at_s, (step, number) in enumerate(steps):
        subject = f"s{number}"
        key = alarm_key(KIND, subject)
        match step:
            case "happened":
                book.happened(KIND, subject, "line", at_s)
                unseen.add(key)
                active.discard(key)
            case "begin":
                book.begin(KIND, subject, "line", at_s)
                if key not in active:
                    unseen.add(key)
                active.add(key)
            case "end":
                book.end(KIND, subject, at_s)
                if key in active:
                    unseen.discard(key)
                active.discard(key)
            case "acknowledge":
                assert book.acknowledge("anna", [key]) == (key in unseen)
                unseen.discard(key)
    return book, unseen, active


@given(STEPS)
def test_what_is_shown_is_what_is_so_and_what_happened_unseen(steps: list[tuple[str, int]]) -> None:
    book, unseen, active = play(steps)
    views = book.views()
    assert {view.key for view in views} == unseen | active
    assert {view.key for view in views if not view.acknowledged_by} == unseen
    assert {view.key for view in views if view.is_active} == active


@given(st.integers(0, 3 * ALARMS_KEPT), st.integers(0, ALARMS_KEPT))
def test_too_many_alarms_drop_seen_ones_before_unseen_ones(more: int, seen: int) -> None:
    book = AlarmBook()
    for number in range(seen):
        book.begin(KIND, f"seen{number}", "line", 0.0)
    book.acknowledge("anna")
    for number in range(more):
        book.happened(KIND, f"new{number}", "line", 1.0)
    shown = [view for view in book.views() if not view.acknowledged_by]
    assert len(shown) == min(more, ALARMS_KEPT)
    assert len(book.views()) <= ALARMS_KEPT


def test_a_condition_that_goes_on_is_one_alarm_and_one_that_comes_back_has_to_be_seen_again() -> None:
    book = AlarmBook()
    book.begin(KIND, "s", "first", 1.0)
    book.begin(KIND, "s", "second", 2.0)
    [view] = book.views()
    assert (view.count, view.line, view.first_s) == (1, "second", 1.0)
    book.acknowledge("anna")
    book.begin(KIND, "s", "third", 3.0)
    assert book.views()[0].acknowledged_by == "anna"
    book.end(KIND, "s", 4.0)
    assert book.views() == []
    book.begin(KIND, "s", "fourth", 5.0)
    [view] = book.views()
    assert (view.count, view.acknowledged_by, view.first_s) == (2, "", 1.0)


def test_what_is_over_is_no_alarm_though_nobody_has_seen_it() -> None:
    book = AlarmBook()
    book.begin(AlarmKind.STOPPED, "scout1", "scout1 was stopped by ben", 1.0, "Lift the stop when the robot may move.")
    book.end(AlarmKind.STOPPED, "scout1", 2.0)
    assert book.views() == []


def test_what_was_over_before_the_operator_came_back_is_told_without_a_remedy() -> None:
    book = AlarmBook()
    book.attention(False, 0.0)
    book.begin(AlarmKind.STOPPED, "scout1", "scout1 was stopped by ben", 1.0, "Lift the stop when the robot may move.")
    book.end(AlarmKind.STOPPED, "scout1", 2.0)
    book.attention(True, 3.0)
    book.look(1000.0)
    [view] = book.views()
    assert (view.while_away, view.is_active, view.remedy) == (True, False, "")
    assert book.acknowledge("anna") == 1
    assert book.views() == []


@pytest.mark.parametrize("kind", [AlarmKind.REFUSED, AlarmKind.NO_ANSWER])
def test_what_merely_happened_fades_the_sooner_the_less_it_matters(kind: AlarmKind) -> None:
    book = AlarmBook()
    book.happened(kind, "scout1", "no", 10.0)
    [view] = book.views()
    book.look(10.0 + FADES_AFTER_S[view.severity])
    assert book.views() == [view]
    book.look(10.1 + FADES_AFTER_S[view.severity])
    assert book.views() == []


def test_a_real_alarm_never_fades() -> None:
    book = AlarmBook()
    book.happened(AlarmKind.LOST, "scout1", "scout1 failed", 10.0, severity=Severity.ALARM)
    book.look(1e6)
    assert book.views()


NEEDS = {
    "scout1": frozenset({"creator-base"}),
    "scout2": frozenset({"creator-base"}),
    "anna-capture": frozenset({"anna", "scout1", "creator-base"}),
}


def needs(name: str) -> frozenset[str]:
    return NEEDS.get(name, frozenset())


def told(*alarms: tuple[AlarmKind, str]) -> list[AlarmView]:
    book = AlarmBook()
    for at_s, (kind, subject) in enumerate(alarms):
        book.begin(kind, subject, f"{subject} {kind}", at_s)
    return one_line_for_one_cause(book.views(), needs)


def test_a_robot_that_is_gone_is_one_line_with_all_that_follows() -> None:
    [view] = told(
        (AlarmKind.STALE_VIDEO, "scout1"),
        (AlarmKind.LOST, "scout1"),
        (AlarmKind.RC_DOWN, "scout1"),
        (AlarmKind.STARVING, "anna-capture"),
        (AlarmKind.ABSENT, "scout1"),
    )
    assert view.line == "scout1 absent"
    assert sorted(view.also) == ["anna-capture starving", "scout1 lost", "scout1 rc_down", "scout1 stale_video"]
    assert len(view.keys) == 5


def test_a_machine_that_is_gone_is_one_line_for_all_that_ran_there() -> None:
    [view] = told((AlarmKind.LOST, "scout1"), (AlarmKind.LOST, "scout2"), (AlarmKind.LOST, "creator-base"))
    assert (view.line, sorted(view.also)) == ("creator-base lost", ["scout1 lost", "scout2 lost"])


def test_without_a_link_what_seems_lost_is_told_with_it_but_not_what_was_before() -> None:
    views = told((AlarmKind.STOPPED, "scout2"), (AlarmKind.LINK, "hub"), (AlarmKind.LOST, "scout1"))
    assert [(view.line, view.also) for view in views] == [
        ("hub link", ["scout1 lost"]),
        ("scout2 stopped", []),
    ]


def test_two_causes_are_two_lines() -> None:
    assert len(told((AlarmKind.LOST, "scout1"), (AlarmKind.LOST, "scout2"))) == 2


def test_a_line_is_seen_with_all_it_stands_for() -> None:
    book = AlarmBook()
    book.begin(AlarmKind.LOST, "scout1", "lost", 1.0)
    book.begin(AlarmKind.RC_DOWN, "scout1", "down", 2.0)
    [view] = one_line_for_one_cause(book.views(), needs)
    assert book.acknowledge("anna", view.keys) == 2
    [view] = one_line_for_one_cause(book.views(), needs)
    assert view.acknowledged_by == "anna"


@given(
    st.lists(st.tuples(st.sampled_from(list(AlarmKind)), st.sampled_from("abcde")), max_size=12),
    st.dictionaries(st.sampled_from("abcde"), st.frozensets(st.sampled_from("abcde"))),
)
def test_whatever_explains_whatever_every_alarm_is_told_exactly_once(
    alarms: list[tuple[AlarmKind, str]], explained: dict[str, frozenset[str]]
) -> None:
    book = AlarmBook()
    for at_s, (kind, subject) in enumerate(alarms):
        book.begin(kind, subject, f"{kind}:{subject}", at_s)
    views = one_line_for_one_cause(book.views(), lambda name: explained.get(name, frozenset()))
    lines = [line for view in views for line in (view.line, *view.also)]
    assert sorted(lines) == sorted(view.line for view in book.views())
    assert sorted(key for view in views for key in view.keys) == sorted(view.key for view in book.views())


def test_five_minutes_of_ordinary_use_are_few_alarms_and_in_the_end_none() -> None:
    """Take over, drive, stop and lift, a robot that dies and comes back, colleagues who come and go, all day's work."""
    fell = ProcessFell("scout1", "killed by SIGKILL", 0.05, ["last words"])
    gone = MissionHealth(HealthWord.DEGRADED, [Absence("scout1", 60.0, "killed by SIGKILL", "starts again in 0.1 s")])
    fine = MissionHealth(HealthWord.OK)
    held = Schedule(
        20.0,
        [rc("scout1", "scout", [Holder("console-1-capture", 7, 20.0, 22.0)], ["watch1-capture"])],
        [
            request("console-1-capture", "ui_console/console-1", RequestState.RUNNING, priority="console-1:100"),
            msgspec.structs.replace(
                request("watch1-capture", "mission_control/watch1", RequestState.WAITING, since_s=20.0),
                blockers=["console-1-capture"],
            ),
        ],
        [],
    )
    down = msgspec.structs.replace(held, rcs=[msgspec.structs.replace(rc("scout1", "scout", []), state="down")])
    ben = msgspec.structs.replace(component("ui_console/console-2", "console", pid=9), user="ben")
    lifted = msgspec.structs.replace(STOP, is_stopped=False)
    steps: dict[float, list[ConsoleEvent]] = {
        20.0: [ASK, GRANT, Heard(20.0, held)],
        30.0: [Heard(30.0, STOP)],
        35.0: [Heard(35.0, lifted)],
        60.0: [
            Heard(60.0, fell),
            Heard(60.0, Disappeared("resource_pool/scout1")),
            Heard(60.0, gone),
            Heard(60.0, down),
            Heard(60.0, Suspended("arc", "rc", "scout1", -1.0)),
            CommandRefused(60.1, "arc.swapped_out", "holds nothing", "wait"),
            LinkTrouble(60.2, "nobody answers"),
        ],
        61.0: [
            Heard(61.0, fine),
            Heard(61.0, component("resource_pool/scout1", "scout", since_s=61.0, pid=77)),
            Heard(61.0, held),
            Granted(61.0, "scout1", GRANT.rcs, GRANT.epochs, 300.0, 60.0, True),
        ],
        90.0: [Heard(90.0, ben)],
        150.0: [Heard(150.0, Disappeared(ben.address))],
        200.0: [Heard(200.0, Suspended("arc", "self", "", -1.0)), GivenBack(200.0, "released", True)],
    }
    shown = model(*TEAM_EVENTS)
    shown.sees = False
    most = {}
    for second in range(20, 321):
        for event in steps.get(float(second), [Heard(float(second), fine)]):
            shown.apply(event)
        lines = [alarm.line for alarm in shown.view(float(second)).alarms]
        most[second] = len(lines)
        assert len(lines) <= 3, (second, lines)
    assert sum(count > 0 for count in most.values()) < 150
    assert most[320] == 0
