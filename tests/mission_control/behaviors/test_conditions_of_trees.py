"""Conditions: leaves of composed trees that wait for events, or read reports."""

from __future__ import annotations

from typing import Any

import pytest
from fake_resource_pool import FakePlacer, Run
from trees_of_components import FAILURE, SUCCESS, Battery, is_running, node, root, set_parameter

from backbone.component.messages import WrongParameter
from backbone.keys import Conversation
from backbone.wire import Message
from mission_control.behaviors.condition import Comparison, MessageConditionParameters
from mission_control.messages import BehaviorStatus, MotionSeen, Region, WaypointReached


def test_a_condition_waits_for_an_event_that_is_as_stated(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        seen = node("condition", "seen", source="watch1", message="MotionSeen", field="region.width_px", above=20)
        top = await root(placer, node("sequence", "react", seen, node("leaf", "go")))
        await placer.wait(lambda: "seen" in placer.components)
        watcher = placer.network.join("mission_control/watch1", placer.clock)
        for source, width_px in (("watch1", 20), ("watch2", 90)):
            event = MotionSeen(1.0, "scout1", Region(0, 0, width_px, 9))
            watcher.publish(f"mission_control/{source}", Conversation.EVENTS, event)
        watcher.publish("mission_control/watch1", Conversation.EVENTS, WaypointReached(1.0, "scout1", 1, 0))
        await placer.clock.sleep_s(10.0)
        assert is_running(placer, "react", "seen")
        watcher.publish("mission_control/watch1", Conversation.EVENTS, MotionSeen(1.0, "scout1", Region(0, 0, 21, 9)))
        await placer.wait(lambda: is_running(placer, "react", "go"), within_s=1.0)
        assert top.feedback == "runs go, 2 of 2, after seen succeeded"
        await watcher.close()

    placer_world(scene)


def test_a_condition_reads_events_of_ones_own(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        low = node("condition", "low", message=f"{__name__}:Battery", field="charge", below=0.2)
        condition = await root(placer, low)
        robot = placer.network.join("resource_pool/scout1", placer.clock)
        robot.publish("resource_pool/scout1", Conversation.EVENTS, Battery(0.5))
        await placer.clock.sleep_s(1.0)
        assert condition.status is BehaviorStatus.RUNNING
        robot.publish("resource_pool/scout1", Conversation.EVENTS, Battery(0.1))
        await placer.wait(lambda: condition.status is SUCCESS, within_s=1.0)
        assert condition.payload == {"detail": "charge is 0.1"}
        await robot.close()

    placer_world(scene)


@pytest.mark.parametrize(("rounds", "status"), [(2, FAILURE), (3, SUCCESS)])
def test_a_check_of_a_report_decides_at_once(placer_world: Run, rounds: int, status: BehaviorStatus) -> None:
    async def scene(placer: FakePlacer) -> None:
        patrol = await root(placer, node("leaf", "patrol"))
        patrol.tell_parent({"rounds": rounds})
        check = {"source": "patrol", "message": "BehaviorState", "field": "payload.rounds", "above": 2, "mode": "check"}
        condition = await root(placer, node("condition", "done", **check))
        await placer.wait(lambda: condition.status.is_final, within_s=1.0)
        assert condition.status is status
        if status is FAILURE:
            assert condition.payload == {"detail": "payload.rounds is 2, wanted: payload.rounds above 2"}

    placer_world(scene)


def test_a_condition_on_a_report_waits_for_a_behavior_that_is_not_there_yet(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        asked = {"source": "patrol", "message": "BehaviorState", "field": "status", "equals": "success"}
        condition = await root(placer, node("condition", "done", **asked))
        await placer.clock.sleep_s(30.0)
        patrol = await root(placer, node("leaf", "patrol"))
        await placer.clock.sleep_s(3.0)
        assert condition.status is BehaviorStatus.RUNNING
        patrol.finish(SUCCESS)
        await placer.wait(lambda: condition.status is SUCCESS, within_s=3.0)

    placer_world(scene)


def test_a_condition_tells_its_new_comparison_and_refuses_what_it_cannot_change(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        asked = {"source": "patrol", "message": "WaypointReached", "field": "number", "above": 2.0}
        condition = await root(placer, node("condition", "done", **asked))
        await placer.wait(lambda: condition.feedback == "waits for WaypointReached of patrol: number above 2")
        await set_parameter(placer, "done", "above", 7.0)
        assert condition.feedback == "waits for WaypointReached of patrol: number above 7"
        for parameter, value in (("source", "other"), ("message", "MotionSeen"), ("keeper", "ui_console/anna")):
            with pytest.raises(WrongParameter, match=f"cannot change {parameter} while it runs"):
                await set_parameter(placer, "done", parameter, value)
        assert condition.parameters.source == "patrol"

    placer_world(scene)


SEEN = WaypointReached(12.0, "scout1", 3, 1)


@pytest.mark.parametrize(
    ("comparison", "holds"),
    [
        (Comparison(), True),
        (Comparison("number"), True),
        (Comparison("height_m"), False),
        (Comparison("number.of"), False),
        (Comparison("number", above=2), True),
        (Comparison("number", above=3), False),
        (Comparison("number", above=2, below=3), False),
        (Comparison("number", equals=3.0), True),
        (Comparison("waypoint", equals=True), False),
        (Comparison("robot", equals="scout1"), True),
        (Comparison("robot", above=0), False),
    ],
)
def test_a_comparison_reads_one_field(comparison: Comparison, holds: bool) -> None:
    assert comparison.holds_for(SEEN) is holds


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"message": "MotionSean"}, "write one of"),
        ({"message": "no.such:Thing"}, "No module named"),
        ({"message": "pathlib:Path"}, "which is no message"),
        ({"message": "MotionSeen", "above": 3.0}, "field is empty"),
        ({"message": "MotionSeen", "source": "Watch 1"}, "component's name or address"),
        ({"message": "BehaviorState"}, "name the behavior"),
        ({"message": "MotionSeen", "field": "at_s", "above": 3.0, "below": 3.0}, "no number is between them"),
        ({"message": "MotionSeen", "field": "width_px"}, "MotionSeen has no 'width_px'"),
        (
            {"message": "MotionSeen", "field": "region.widht_px"},
            "did you mean 'width_px'",
        ),
        ({"message": "MotionSeen", "field": "robot.name"}, "robot of MotionSeen has no parts"),
        ({"message": "MotionSeen", "field": "robot", "above": 1.0}, "robot of MotionSeen is never above it"),
        ({"message": "MotionSeen", "field": "region.width_px", "below": 0.0}, "is never below it"),
        ({"message": "MotionSeen", "field": "region.width_px", "equals": "wide"}, 'equals is "wide"'),
        ({"message": "MotionSeen", "field": "region.width_px", "equals": True}, "equals is true"),
        (
            {"message": "BehaviorState", "source": "a", "field": "status", "equals": "done"},
            "one of running, success",
        ),
    ],
)
def test_a_condition_that_cannot_be_is_refused(parameters: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        MessageConditionParameters(**parameters)


class Odd(Message, frozen=True):
    """An event with fields of which little is known."""

    any: Any
    either: int | str | None
    deep: dict[str, dict[str, float]]


@pytest.mark.parametrize(
    "parameters",
    [
        {"message": "BehaviorState", "source": "a", "field": "status", "equals": "success"},
        {"message": "BehaviorState", "source": "a", "field": "payload.anything.below", "above": 1.0},
        {"message": "Readings", "source": "scout1", "field": "values.anything", "equals": "x"},
        {"message": f"{__name__}:Odd", "field": "any.thing", "equals": True},
        {"message": f"{__name__}:Odd", "field": "either", "equals": "x"},
        {"message": f"{__name__}:Odd", "field": "either", "below": -5.0},
        {"message": f"{__name__}:Odd", "field": "deep.a.b", "above": 0.0, "below": 1.0},
        {"message": f"{__name__}:Battery", "field": "charge", "equals": 1},
    ],
)
def test_a_condition_that_may_become_true_is_not_refused(parameters: dict[str, Any]) -> None:
    MessageConditionParameters(**parameters)
