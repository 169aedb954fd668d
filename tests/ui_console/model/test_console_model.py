"""What screens show follows from what was heard."""

from __future__ import annotations

import json

import msgspec
import pytest
from console_scenes import (
    ASK,
    EVENTS,
    GRANT,
    LEASES,
    SCHEDULE,
    STOP,
    TEAM_EVENTS,
    component,
    held_model,
    model,
    rc,
    request,
)
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import LifeState, Parameters, SetParameter, StoryEvent
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.nameserver.messages import Components, Disappeared
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule, Why
from backbone.wire import plain
from resource_pool.arc_client import Suspended
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.console import SILENT_S, STALE_S, ConsoleModel
from ui_console.model.events import (
    AbilitiesKnown,
    Asked,
    CommandApplied,
    CommandRefused,
    ConsoleEvent,
    GivenBack,
    Heard,
    LinkHeard,
    OrderChanged,
    PictureSeen,
    TurnedTo,
)
from ui_console.model.orders import GivenOrder, Order, OrderKind, OrderState
from ui_console.model.views import AlarmKind, NodeState, Severity, view_json


def test_the_robot_table_says_who_holds_what_since_when_until_when_and_who_waits() -> None:
    held, free = model(Heard(8.0, SCHEDULE)).robots(8.0)
    assert [(row.number, row.robot) for row in (held, free)] == [(1, "scout1"), (2, "scout2")]
    assert (held.holder, held.is_console, held.is_mine, held.epoch) == ("watch1", False, False, 6)
    assert (held.priority, held.since_s, held.until_s) == ("iros2001:10/surveillance:5/watch1:3", 5.0, 10.0)
    assert held.waiting == ["console-1"]
    assert (free.holder, free.is_up) == ("", True)


def test_robots_have_their_numbers_in_the_order_of_counting() -> None:
    """The key 2 took scout10, and the next robot after scout1 was scout10."""
    shown = model(Heard(8.0, Schedule(8.0, [rc(f"scout{n}", "scout", []) for n in (10, 1, 2)], [], [])))
    assert [(row.number, row.robot) for row in shown.robots(8.0)] == [(1, "scout1"), (2, "scout2"), (3, "scout10")]
    assert shown.team.robots.names() == ["scout1", "scout2", "scout10"]


def test_a_lease_grows_old_until_it_is_renewed() -> None:
    shown = model(Heard(8.0, SCHEDULE), Heard(8.0, LEASES))
    assert (shown.robots(9.5)[0].lease_age_s, shown.robots(9.5)[0].lease_left_s) == (1.5, 0.5)
    shown.apply(Heard(9.5, LEASES))
    assert shown.robots(9.75)[0].lease_age_s == 0.25
    assert shown.robots(60.0)[0].lease_left_s == 0.0


def test_a_robot_that_is_called_missing_is_not_up() -> None:
    leases = msgspec.structs.replace(LEASES, missing=["scout2"])
    assert [row.is_up for row in model(Heard(8.0, SCHEDULE), Heard(8.0, leases)).robots(8.0)] == [
        True,
        False,
    ]


def test_the_robot_held_is_marked_as_ones_own() -> None:
    mine, other = held_model().robots(12.0)
    assert (mine.is_mine, mine.holder, mine.is_console) == (True, "console-1", True)
    assert mine.video is not None
    assert not other.is_mine


def test_requests_come_running_first_then_by_predicted_start() -> None:
    late = request("late", "mission_control/late", RequestState.WAITING, expected_s=30.0)
    never = request("never", "mission_control/never", RequestState.WAITING)
    schedule = msgspec.structs.replace(SCHEDULE, requests=[never, late, *reversed(SCHEDULE.requests)])
    rows = model(Heard(8.0, schedule)).team.requests()
    assert [row.arc for row in rows] == ["watch1-capture", "console-1-capture", "late", "never"]
    assert rows[0].because == "its turn"


def test_the_tree_puts_children_below_their_parents_with_priority_state_and_feedback() -> None:
    nodes = model(*TEAM_EVENTS).team.tree()
    assert [(n.depth, n.name, n.priority, n.parent) for n in nodes] == [
        (0, "surveillance", 5, ""),
        (1, "watch1", 3, "surveillance"),
        (1, "watch2", None, "surveillance"),
    ]
    assert (nodes[1].state, nodes[1].feedback, nodes[1].arc) == (
        NodeState.RUNNING,
        "holds scout scout1",
        "watch1-capture",
    )


def test_a_node_that_finished_says_how_and_one_that_is_lost_keeps_its_place() -> None:
    done = Heard(9.0, StoryEvent(9.0, "mission_control/watch2", "finished: failure", "watch2", ""))
    nodes = model(*TEAM_EVENTS, done, Heard(9.0, Disappeared("mission_control/watch1"))).team.tree()
    assert [(n.name, n.state) for n in nodes[1:]] == [("watch1", NodeState.LOST), ("watch2", NodeState.FAILURE)]


def test_a_unit_that_runs_modules_is_no_node_of_the_tree() -> None:
    found = [component("mission_control/vision", "execution_unit"), component("mission_control/hide", "hide")]
    nodes = model(Heard(1.0, Components(found, True, 0.0))).team.tree()
    assert [node.name for node in nodes] == ["hide"]


def test_a_node_whose_arc_waits_says_why() -> None:
    waiting = request("watch2-capture", "mission_control/watch2", RequestState.WAITING, priority="watch2:1")
    schedule = Schedule(9.0, [], [waiting], [])
    node = model(*TEAM_EVENTS, Heard(9.0, schedule)).team.tree()[2]
    assert (node.state, node.because) == (NodeState.WAITING, "its turn")


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=20))
def test_every_behavior_is_in_the_tree_once_whoever_claims_to_have_started_it(parents: list[tuple[int, int]]) -> None:
    states = {
        child: component(f"mission_control/b{child}", "x", requester=f"mission_control/b{parent}")
        for child, parent in parents
        if child > parent
    }
    nodes = model(Heard(1.0, Components(list(states.values()), True, 0.0))).team.tree()
    assert sorted(node.name for node in nodes) == sorted(f"b{child}" for child in states)
    depths = {node.name: node.depth for node in nodes}
    assert all(node.depth == depths.get(node.parent, -1) + 1 for node in nodes)


def test_the_status_line_follows_a_take_over_from_wish_to_release() -> None:
    shown = model()
    assert shown.status_line(9.0) == "watching; you hold no robot"
    shown.apply(ASK)
    assert shown.status_line(9.96) == "waiting for scout1"
    shown.apply(Heard(9.97, Why("c", "waiting", ["watch1 has its minimum run time"], "R5", [], 12.0, "")))
    assert shown.status_line(9.97) == "waiting for scout1: watch1 has its minimum run time"
    shown.apply(GRANT)
    assert shown.status_line(11.0) == "you hold scout1, slice 4 s"
    shown.apply(Heard(11.0, STOP))
    assert shown.status_line(11.0) == "scout1 is STOPPED by anna: child in the room"
    shown.apply(Heard(12.0, Suspended("arc", "higher", "console-2", -1.0)))
    assert shown.status_line(12.0) == "waiting for scout1: console-2 has the higher priority"
    assert shown.own(12.0).taken_because == "console-2 has the higher priority"
    shown.apply(GivenBack(13.0, "released", True))
    assert shown.status_line(13.0) == "watching; you hold no robot"


def test_pictures_tell_their_age_rate_and_latency_and_are_forgotten_with_the_robot() -> None:
    shown = model(GRANT, *[PictureSeen(10.0 + n / 10, 9.95 + n / 10, "scout1") for n in range(31)])
    [video] = shown.videos(13.0)
    assert (round(video.age_s, 3), round(video.rate_hz, 1), round(video.latency_s, 3)) == (0.05, 10.0, 0.05)
    assert shown.videos(13.0 + STALE_S)[0].is_stale
    shown.apply(GivenBack(14.0, "released", True))
    assert shown.videos(14.0) == []


@pytest.mark.parametrize("gives_pictures", [True, False])
def test_missing_pictures_are_an_alarm_only_of_an_arc_that_gives_any(gives_pictures: bool) -> None:
    shown = model(ASK, AbilitiesKnown(9.9, ArcAbilities(None, True, [], gives_pictures)), GRANT)
    alarms = [alarm.kind for alarm in shown.view(GRANT.at_s + SILENT_S + 0.1).alarms]
    assert alarms == [AlarmKind.STALE_VIDEO] * gives_pictures


def test_a_round_trip_of_commands_is_among_the_links() -> None:
    shown = model(LinkHeard(1.0, True, 0.002), CommandApplied(1.0, "scout1", 7, "drive", {}, 0.004))
    assert [(link.name, link.latency_s) for link in shown.links(1.0)] == [("hub", 0.002), ("commands to scout1", 0.004)]


def test_a_parameter_that_was_changed_says_what_it_was_and_who_changed_it() -> None:
    at = "mission_control/watch1"
    shown = model(
        Heard(1.0, Parameters({"t": 20, "w": 1}), at),
        Heard(2.0, SetParameter("t", 30, "anna"), at),
        Heard(2.0, Parameters({"t": 30, "w": 1}), at),
    )
    changed, other = shown.team.parameters()
    assert (changed.value, changed.before, changed.changed_by) == ("30", "20", "anna")
    assert (other.value, other.changed_by) == ("1", "")


def test_what_operators_did_is_in_the_log_with_their_names() -> None:
    act = OperatorActed("anna", OperatorAction.SET_PARAMETER, "watch1", "t = 30", 2.0)
    shown = model(Heard(2.1, act, "ui_console/console-1"))
    assert shown.log() == [act.event("ui_console/console-1")]


def test_consoles_that_share_a_team_see_the_same_mission_and_hold_robots_of_their_own() -> None:
    one = model(Heard(8.0, SCHEDULE))
    two = ConsoleModel("console-2", team=one.team)
    two.apply(GRANT)
    assert two.robots(8.0)[0].is_mine
    assert not one.robots(8.0)[0].is_mine


def test_a_view_is_json_and_comes_back_as_it_was() -> None:
    view = held_model().view(12.0)
    assert msgspec.json.decode(view_json(view)) == msgspec.to_builtins(plain(view))
    shown = json.loads(view_json(view))
    assert shown["robots"][0]["holder"] == "console-1"
    assert shown["own"]["is_held"] is True


@given(st.lists(st.sampled_from(EVENTS), max_size=60), st.floats(0, 200))
def test_whatever_is_heard_in_whatever_order_the_view_is_whole_and_consistent(
    events: list[ConsoleEvent], now_s: float
) -> None:
    shown = model(*events)
    view = shown.view(now_s)
    assert msgspec.json.decode(view_json(view)) == msgspec.to_builtins(plain(view))
    assert view.own.is_held <= view.own.is_asked or GRANT in events
    assert sum(robot.is_mine for robot in view.robots) <= 1
    assert len({alarm.key for alarm in view.alarms}) == len(view.alarms)
    order = [(bool(alarm.acknowledged_by), list(Severity).index(alarm.severity)) for alarm in view.alarms]
    assert order == sorted(order)
    assert all(robot.lease_left_s >= 0 for robot in view.robots if robot.holder)


def test_a_slice_that_ends_now_has_no_number_and_one_kept_longer_says_so() -> None:
    """Schedules without a waiting ARC let a console keep its robot beyond its slice."""
    shown = held_model()
    assert shown.status_line(GRANT.until_s - 3.0).endswith("slice 3 s")
    assert "slice" not in shown.status_line(GRANT.until_s - 0.4)
    assert "slice" not in shown.status_line(GRANT.until_s + 0.4)
    assert shown.status_line(GRANT.until_s + 7.0).endswith(", beyond its slice")


def test_what_a_component_says_of_itself_counts_also_if_its_readiness_was_dated_later_by_who_saw_it() -> None:
    appeared = component("ui_console/console-9", "console", since_s=5.2)
    shown = model(
        Heard(5.2, appeared),
        Heard(6.0, component(appeared.address, "console", since_s=5.0, feedback="drives scout1")),
    )
    assert [row.feedback for row in shown.team.components()] == ["drives scout1"]
    draining = component(appeared.address, "console", since_s=7.0, state=LifeState.DRAINING)
    shown.apply(Heard(7.0, draining))
    shown.apply(Heard(7.1, appeared))
    assert [row.state for row in shown.team.components()] == ["draining"]


def test_a_claim_that_was_refused_waits_for_nothing_and_says_why_until_the_next() -> None:
    detail = "no scout is named 'scuot1' (did you mean 'scout1'?)"
    shown = model(Asked(1.0, "scuot1", "capture", 100), CommandRefused(1.5, "creator.start_failed", detail, "", True))
    assert shown.status_line(100.0) == f"you hold no robot: {detail}"
    assert not shown.own(100.0).is_asked
    shown.apply(ASK)
    assert shown.status_line(101.0) == "waiting for scout1"


def test_a_console_that_waits_says_the_reason_without_repeating_who_waits() -> None:
    line = "console-1-capture waiting: since 24.54 s (3.5 s) for console-9-capture"
    why = Why("console-1-capture", "waiting", [line], "3", [], -1.0, "")
    shown = model(ASK, Heard(2.0, why))
    assert shown.status_line(3.0) == "waiting for scout1: since 24.54 s (3.5 s) for console-9-capture"


def test_an_order_whose_robot_a_person_took_names_that_person() -> None:
    order = Order(OrderKind.RETURN, "scout1")
    waits = GivenOrder(order, 1, OrderState.WAITING, "higher by console-8-capture")
    ben = msgspec.structs.replace(component("ui_console/console-8", "console"), user="ben")
    there = Components([ben], True, 0.0)
    shown = model(Heard(8.0, SCHEDULE), Heard(8.0, there), TurnedTo(9.0, "scout1"), OrderChanged(9.0, waits))
    own = shown.own(9.5)
    assert own.status == "scout1: return (waiting: higher by ben)"
    assert [(view.line, view.why) for view in own.orders] == [(own.status, "higher by ben")]
