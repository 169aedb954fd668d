"""What becomes an alarm at a console, and what ends it."""

from __future__ import annotations

import msgspec
import pytest
from console_scenes import (
    GRANT,
    SCHEDULE,
    STOP,
    TEAM_EVENTS,
    component,
    model,
    rc,
    request,
)

from backbone.component.messages import LifeState, Statistics
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.nameserver.messages import Disappeared
from backbone.picture.health import HealthWord, MissionHealth
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule
from resource_pool.arc_client import StopState
from ui_console.model.console import SILENT_S, STALE_S, ConsoleModel
from ui_console.model.events import (
    Attention,
    CommandRefused,
    ConsoleEvent,
    GivenBack,
    Heard,
    LinkHeard,
    LinkTrouble,
    PictureSeen,
)
from ui_console.model.team import STARVING_S
from ui_console.model.views import AlarmKind


def alarm_lines(shown: ConsoleModel, now_s: float = 50.0) -> list[str]:
    shown.apply(Heard(now_s, MissionHealth(HealthWord.OK)))
    shown.look(now_s)
    return [alarm.line for alarm in shown.alarm_views()]


def test_pictures_that_stay_away_or_grow_old_are_an_alarm_until_they_come_again() -> None:
    shown = model(GRANT)
    assert alarm_lines(shown, 10.0 + SILENT_S) == []
    assert alarm_lines(shown, 10.5 + SILENT_S) == ["no picture of scout1 came within 4 s"]
    shown.apply(PictureSeen(14.0, 13.9, "scout1"))
    assert alarm_lines(shown, 14.0) == []
    assert alarm_lines(shown, 14.0 + 2 * STALE_S) == ["the picture of scout1 is 2.1 s old"]
    shown.apply(GivenBack(17.0, "released", True))
    assert alarm_lines(shown, 17.0) == []


def test_a_console_without_a_picture_of_its_own_misses_none() -> None:
    shown = ConsoleModel("console-1", sees=False)
    shown.apply(GRANT)
    shown.look(100.0)
    assert shown.team.alarms.views() == []


def test_a_component_that_is_gone_without_a_word_is_an_alarm_until_it_is_back() -> None:
    shown = model(*TEAM_EVENTS, Heard(9.0, Disappeared("resource_pool/scout1")))
    assert alarm_lines(shown) == ["scout1 (scout) on base is lost"]
    shown.apply(Heard(10.0, component("resource_pool/scout1", "scout", since_s=10.0, pid=101)))
    assert alarm_lines(shown) == []


@pytest.mark.parametrize("ends_first", [True, False])
def test_one_that_left_in_good_order_is_none_in_whichever_order_it_is_heard(ends_first: bool) -> None:
    leaves: list[ConsoleEvent] = [
        Heard(9.0, component("resource_pool/scout1", "scout", state=LifeState.STOPPED, since_s=9.0)),
        Heard(9.0, Disappeared("resource_pool/scout1")),
    ]
    shown = model(*TEAM_EVENTS, *(leaves if ends_first else reversed(leaves)))
    assert alarm_lines(shown) == []
    assert shown.team.component("scout1") is None


def test_a_process_that_fell_says_how_and_whether_it_comes_again() -> None:
    fell = ProcessFell("scout1", "signal 9", 0.05, ["last words"])
    shown = model(Heard(3.0, fell))
    [alarm] = shown.team.alarms.views()
    assert (alarm.line, alarm.remedy, alarm.subject) == (
        "scout1 fell: signal 9; again in 0.1 s (it said: last words)",
        "",
        "scout1",
    )


def test_a_request_that_waits_long_without_a_prospect_starves_and_stops_starving_when_it_runs() -> None:
    starving = request("watch2-capture", "mission_control/watch2", RequestState.WAITING, since_s=5.0)
    shown = model(Heard(6.0, Schedule(6.0, [], [starving], [])))
    assert alarm_lines(shown, 5.0 + STARVING_S - 1) == []
    assert alarm_lines(shown, 5.0 + STARVING_S) == ["watch2 waits for 30 s and no end is in sight: its turn"]
    shown.apply(Heard(41.0, Schedule(41.0, [], [], [])))
    assert alarm_lines(shown, 41.0) == []


def test_packets_late_on_a_radio_are_an_alarm_each_time_there_are_more() -> None:
    shown = model(Heard(1.0, Statistics({"overruns_a": 0.0}), "resource_pool/radio"))
    assert alarm_lines(shown) == []
    shown.apply(Heard(1.5, Statistics({"overruns_a": 1.0}), "resource_pool/radio"))
    assert alarm_lines(shown) == ["1 packet of a on radio was late or lost"]
    for at_s, overruns in ((2.0, 1.0), (4.0, 5.0)):
        shown.apply(Heard(at_s, Statistics({"overruns_a": overruns}), "resource_pool/radio"))
    [alarm] = shown.team.alarms.views()
    assert (alarm.kind, alarm.count, alarm.line) == (
        AlarmKind.DEADLINE,
        2,
        "5 packets of a on radio were late or lost",
    )


@pytest.mark.parametrize(
    ("events", "kind"),
    [
        ([LinkHeard(1.0, False)], AlarmKind.LINK),
        ([Heard(1.0, HostLoad("base", [], 0.99, 0.5, 2, 9))], AlarmKind.OVERLOAD),
        ([Heard(1.0, Schedule(1.0, [msgspec.structs.replace(rc("s", "scout", []), state="down")], [], []))],
         AlarmKind.RC_DOWN),
        ([Heard(1.0, component("resource_pool/s", "scout", feedback="free, not safe after a"))],
         AlarmKind.UNSAFE),
        ([Heard(1.0, STOP)], AlarmKind.STOPPED),
        ([Heard(1.0, component("backbone/rc_manager", "rc_manager",
                                        feedback="the trace of the schedule stopped: No space left on device"))],
         AlarmKind.NOT_RECORDED),
    ],
)  # fmt: skip
def test_what_is_wrong_is_an_alarm_while_it_is_so(events: list[ConsoleEvent], kind: AlarmKind) -> None:
    shown = model(*events)
    [alarm] = shown.team.alarms.views()
    assert (alarm.kind, alarm.is_active) == (kind, True)


def test_an_older_word_on_a_stop_changes_nothing() -> None:
    lifted = StopState("scout1", False, 1, "ben", "", 12.0)
    shown = model(Heard(11.0, STOP), Heard(12.0, lifted), Heard(12.1, STOP))
    assert shown.team.robots.stop_of("scout1") is None
    shown.apply(Heard(13.0, StopState("scout1", True, 2, "eve", "", 13.0)))
    assert shown.team.robots.stop_of("scout1") is not None


def test_what_was_refused_is_told_once_and_counted_and_an_operators_stop_is_no_second_alarm() -> None:
    refused = CommandRefused(3.0, "arc.swapped_out", "holds nothing", "wait")
    stopped = CommandRefused(3.0, "robot.emergency_stop", "stopped", "lift")
    shown = model(*[refused] * 20, stopped, LinkTrouble(4.0, "nobody"))
    assert [(alarm.line, alarm.count) for alarm in shown.alarm_views()] == [
        ("no answer: nobody", 1),
        ("refused: holds nothing", 20),
    ]


def test_alarms_while_the_operator_was_away_are_marked_until_they_are_seen() -> None:
    shown = model(Attention(1.0, False), LinkTrouble(2.0, "nobody"), Attention(3.0, True), Heard(4.0, STOP))
    assert [alarm.while_away for alarm in shown.alarm_views()] == [False, True]
    assert shown.acknowledge() == 2
    [stop] = shown.alarm_views()
    assert (stop.kind, stop.acknowledged_by, stop.while_away) == (AlarmKind.STOPPED, "anna", False)


def test_of_consoles_that_come_and_go_all_day_nothing_is_left() -> None:
    shown = model(*TEAM_EVENTS)
    for number in range(50):
        name = f"console-{number}"
        address, arc = f"ui_console/{name}", f"{name}-drive"
        asked = request(arc, address, RequestState.RUNNING, priority=f"console {name}:100")
        for at in (address, f"resource_pool/{arc}"):
            shown.apply(Heard(10.0, component(at, "console", since_s=10.0)))
        shown.apply(Heard(10.0, Schedule(10.0, [], [asked], [])))
        shown.apply(Heard(10.0, Statistics({f"overruns_{arc}": 0.0}), "resource_pool/radio"))
        for at in (f"resource_pool/{arc}", address):
            shown.apply(Heard(11.0, component(at, "console", state=LifeState.STOPPED, since_s=11.0)))
            shown.apply(Heard(11.0, Disappeared(at)))
    shown.apply(Heard(12.0, SCHEDULE))
    view = shown.view(12.0)
    assert not [row for row in view.components if "/console-" in row.address]
    assert view.alarms == []
    assert len(shown.team.tree()) == 3
