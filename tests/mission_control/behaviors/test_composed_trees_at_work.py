"""Composed trees of real components, with a placer that decides nothing and ARCs that come and go, on virtual time."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component
from backbone.component.messages import Parameters, SetParameter
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from backbone.placer.messages import Ended, NoHost, StopComponent
from backbone.wire import Message
from mission_control.behavior import Behavior
from mission_control.behaviors.condition import Comparison, MessageCondition, MessageConditionParameters
from mission_control.behaviors.fallback import Fallback
from mission_control.behaviors.parallel import Parallel
from mission_control.behaviors.repeat import Repeat
from mission_control.behaviors.retry import Retry
from mission_control.behaviors.sequence import Sequence
from mission_control.behaviors.timeout import Timeout
from mission_control.behaviors.wait import Wait
from mission_control.messages import (
    AskBehavior,
    BehaviorState,
    BehaviorStatus,
    MotionSeen,
    Region,
    WaypointReached,
)

ARC = {"kind": "drive", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
SUCCESS, FAILURE = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE
Run = Callable[[Callable[[FakePlacer], Awaitable[None]]], None]


class Leaf(Behavior[Any]):
    """Does nothing until the test ends it."""


class Battery(Message, frozen=True):
    """An event of one's own."""

    charge: float


CLASSES: dict[str, type[Component[Any]]] = {
    "leaf": Leaf,
    "sequence": Sequence,
    "fallback": Fallback,
    "parallel": Parallel,
    "retry": Retry,
    "repeat": Repeat,
    "timeout": Timeout,
    "wait": Wait,
    "condition": MessageCondition,
}


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    def run(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), CLASSES)
                try:
                    await scene(placer)
                finally:
                    await placer.close()

        run_virtual(main())

    return run


def node(kind: str, name: str, *children: dict[str, Any], arc: Any = None, **parameters: Any) -> dict[str, Any]:
    return {
        "type": kind,
        "name": name,
        "priority": 3,
        "children": list(children),
        "parameters": parameters,
        "arc": arc,
    }


async def root(placer: FakePlacer, tree: dict[str, Any]) -> Any:
    return await placer.launch(behavior_order(tree, [("iros2001", 10)]))


async def granted(placer: FakePlacer, leaf: str) -> Any:
    """Return the leaf's ARC, with its first grant."""
    await placer.wait(lambda: f"{leaf}-drive" in placer.arcs)
    arc = placer.arcs[f"{leaf}-drive"]
    await arc.grant()
    await placer.clock.sleep_s(0.1)
    return arc


async def ended(placer: FakePlacer, name: str, status: BehaviorStatus, **payload: Any) -> None:
    """End a leaf with this status, as soon as it is there."""
    await placer.wait(lambda: name in placer.components)
    leaf = placer.components[name]
    leaf.finish(status, payload)
    await placer.wait(lambda: placer.components.get(name) is not leaf)


def is_running(placer: FakePlacer, *names: str) -> bool:
    return set(placer.components) == set(names)


async def tree_of(placer: FakePlacer, name: str) -> list[str]:
    """Return the drawing of a branch."""
    state = await placer.bus.ask(f"mission_control/{name}", AskBehavior(), BehaviorState, within_s=1.0)
    return state.tree.splitlines()


async def set_parameter(placer: FakePlacer, name: str, parameter: str, value: object) -> None:
    await placer.bus.ask(f"mission_control/{name}", SetParameter(parameter, value, "anna"), Parameters, within_s=1.0)


# ---------------------------------------------------------------------- whole branches
def test_a_late_patrol_is_followed_by_the_way_home_and_that_by_hiding(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        patrol = node("timeout", "one-minute", node("leaf", "patrol", arc=ARC), seconds=60.0)
        top = await root(placer, node("fallback", "day", patrol, node("leaf", "go-home"), node("leaf", "hide")))
        await granted(placer, "patrol")
        await placer.clock.sleep_s(55.0)
        assert is_running(placer, "day", "one-minute", "patrol")
        assert (await tree_of(placer, "day"))[2] == "│  └─ patrol (leaf, priority 3): running"
        await placer.wait(lambda: is_running(placer, "day", "go-home"), within_s=10.0)
        why = "because one-minute failed: patrol was not done within 60 s"
        assert top.feedback == f"runs go-home, 2 of 3, {why}"
        assert await tree_of(placer, "day") == [
            f"day (fallback, priority 3): running; runs go-home, 2 of 3, {why}",
            "├─ one-minute (timeout, priority 3): failed: patrol was not done within 60 s",
            "│  └─ patrol (leaf, priority 3)",
            "├─ go-home (leaf, priority 3): running",
            "└─ hide (leaf, priority 3): not started",
        ]
        assert top.absences() == [], "a plan for the worse is no alarm"
        await ended(placer, "go-home", FAILURE, code="servo.lost", detail="no landmark")
        await placer.wait(lambda: is_running(placer, "day", "hide"))
        assert top.absences() == []
        await ended(placer, "hide", SUCCESS)
        assert (top.status, placer.started.count("patrol")) == (SUCCESS, 1)

    placer_world(scene)


def test_while_a_person_has_the_robot_the_minute_stands_still_through_all_levels(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        steps = node("sequence", "steps", node("retry", "again", node("leaf", "patrol", arc=ARC), num_attempts=1))
        top = await root(placer, node("timeout", "one-minute", steps, seconds=60.0))
        await placer.clock.sleep_s(100.0)
        assert top.feedback.startswith("waits (steps: again: patrol: no grant yet), ")
        arc = await granted(placer, "patrol")
        await placer.clock.sleep_s(30.0)
        await arc.suspend("higher", "console-1")
        await placer.clock.sleep_s(500.0)
        assert top.suspended_because == "steps: again: patrol: higher by console-1"
        assert (await tree_of(placer, "one-minute"))[-1].endswith(
            "patrol (leaf, priority 3): suspended: higher by console-1"
        )
        assert top.status is BehaviorStatus.RUNNING
        await arc.grant()
        await placer.clock.sleep_s(25.0)
        assert top.status is BehaviorStatus.RUNNING
        await placer.clock.sleep_s(10.0)
        assert (top.status, is_running(placer, "one-minute")) == (FAILURE, True)

    placer_world(scene)


def test_a_timeout_that_counts_ends_a_child_that_a_person_holds_up(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        patrol = node("leaf", "patrol", arc=ARC)
        top = await root(placer, node("timeout", "one-minute", patrol, seconds=60.0, while_suspended="count"))
        arc = await granted(placer, "patrol")
        await arc.suspend("higher", "console-1")
        await placer.wait(lambda: top.status is FAILURE, within_s=65.0)

    placer_world(scene)


def test_the_next_alternative_stands_in_until_the_first_has_its_robot_back(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        first, second = node("leaf", "first", arc=ARC), node("leaf", "second")
        settings = {"while_suspended": "next", "patience_s": 5.0}
        top = await root(placer, node("fallback", "watch", first, second, **settings))
        arc = await granted(placer, "first")
        held = placer.components["first"]
        for _ in range(3):
            await arc.suspend("higher", "console-1")
            await placer.clock.sleep_s(3.0)
            assert is_running(placer, "watch", "first")
            await placer.wait(lambda: is_running(placer, "watch", "first", "second"), within_s=5.0)
            assert top.feedback == "runs second, 2 of 2, because first is suspended: higher by console-1"
            await arc.grant()
            await placer.wait(lambda: is_running(placer, "watch", "first"), within_s=5.0)
        assert placer.components["first"] is held
        assert top.status is BehaviorStatus.RUNNING

    placer_world(scene)


def test_an_attempt_that_a_person_holds_up_fails_and_the_next_one_begins(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        patience = {"while_suspended": "fail", "patience_s": 5.0}
        patrol = node("leaf", "patrol", arc=ARC)
        top = await root(placer, node("retry", "again", patrol, num_attempts=2, pause_s=1.0, **patience))
        arc = await granted(placer, "patrol")
        held = placer.components["patrol"]
        await arc.suspend("higher", "console-1")
        await placer.clock.sleep_s(4.0)
        assert placer.components["patrol"] is held
        because = "because patrol failed: it was suspended for 5 s: higher by console-1"
        await placer.wait(lambda: top.feedback.endswith(f", attempt 2 of 2, {because}"), within_s=5.0)
        await placer.wait(lambda: placer.components.get("patrol") not in (held, None), within_s=5.0)
        await placer.wait(lambda: top.status is FAILURE, within_s=10.0)  # its second life gets no grant at all

    placer_world(scene)


def test_a_parallel_succeeds_without_the_child_that_a_person_holds_up(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        held, free = node("leaf", "held", arc=ARC), node("leaf", "free")
        top = await root(placer, node("parallel", "both", held, free, while_suspended="skip", patience_s=5.0))
        arc = await granted(placer, "held")
        await arc.suspend("higher", "console-1")
        await placer.clock.sleep_s(6.0)
        assert top.feedback == "runs free, 0 of 1 needed successes, without held, suspended for too long"
        assert is_running(placer, "both", "held", "free")
        await ended(placer, "free", SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)
        await placer.wait(lambda: is_running(placer, "both"))

    placer_world(scene)


def test_grants_that_change_faster_than_children_start_and_stop_leave_the_right_one(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        first, second = node("leaf", "first", arc=ARC), node("leaf", "second")
        await root(placer, node("fallback", "watch", first, second, while_suspended="next", patience_s=0.0))
        arc = await granted(placer, "first")
        for pause_s in (0.0, 0.001, 0.002, 0.005, 0.01, 0.02) * 5:
            await arc.suspend("slice", "other", deadline_s=0.0)
            await placer.clock.sleep_s(pause_s)
            await arc.grant()
            await placer.clock.sleep_s(pause_s)
        await placer.clock.sleep_s(2.0)
        assert is_running(placer, "watch", "first")
        await arc.suspend("slice", "other", deadline_s=0.0)
        await placer.clock.sleep_s(2.0)
        assert is_running(placer, "watch", "first", "second")

    placer_world(scene)


def test_the_first_of_two_to_succeed_ends_the_other(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        race = node("parallel", "race", node("leaf", "a"), node("wait", "b", seconds=30.0), success_count=1)
        top = await root(placer, race)
        await placer.wait(lambda: top.status is SUCCESS, within_s=35.0)
        assert 30.0 <= placer.clock.now_s() < 31.0
        await placer.wait(lambda: is_running(placer, "race"))
        assert [line.partition(": ")[2] for line in await tree_of(placer, "race")] == ["success", "ended", "success"]

    placer_world(scene)


def test_a_retry_and_a_repeat_start_their_child_as_often_as_they_are_told(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        tree = node("retry", "try", node("repeat", "often", node("leaf", "a"), num_cycles=2), num_attempts=2)
        top = await root(placer, tree)
        for status in (SUCCESS, FAILURE, SUCCESS, SUCCESS):
            assert top.status is BehaviorStatus.RUNNING
            await ended(placer, "a", status)
        await placer.wait(lambda: top.status is SUCCESS)
        assert (placer.started.count("a"), placer.started.count("often")) == (4, 2)

    placer_world(scene)


def test_a_child_that_cannot_start_is_a_failure_like_others(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.refusals["drive"] = NoHost("no host has tag radio")
        top = await root(placer, node("fallback", "day", node("leaf", "patrol", arc=ARC), node("leaf", "hide")))
        await placer.wait(lambda: is_running(placer, "day", "hide"), within_s=120.0)
        assert top.feedback == "runs hide, 2 of 2, because patrol failed: no host has tag radio"

    placer_world(scene)


def test_only_the_root_that_has_no_answer_left_is_an_alarm(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("sequence", "day", node("sequence", "steps", node("leaf", "a"))))
        await placer.wait(lambda: "a" in placer.components)
        steps = placer.components["steps"]
        placer.components["a"].finish(FAILURE, {"code": "servo.lost", "detail": "no landmark"})
        await placer.wait(lambda: top.status is FAILURE)
        assert steps.absences() == []
        assert [(absence.name, absence.cause) for absence in top.absences()] == [("day", "no landmark")]
        assert (await tree_of(placer, "day"))[1].endswith("steps (sequence, priority 3): failed: no landmark")

    placer_world(scene)


def test_a_step_that_an_operator_stops_is_passed_over(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("sequence", "steps", node("leaf", "a"), node("leaf", "b")))
        await placer.wait(lambda: "a" in placer.components)
        operator = placer.network.join("ui_console/cli", placer.clock)
        await operator.ask("backbone/placer", StopComponent("a", "by command"), Ended, within_s=5.0)
        await operator.close()
        await placer.wait(lambda: is_running(placer, "steps", "b"))

    placer_world(scene)


def test_a_parameter_changed_at_work_counts_at_once(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("timeout", "limit", node("leaf", "a"), seconds=1000.0))
        await placer.clock.sleep_s(20.0)
        await set_parameter(placer, "limit", "seconds", 30.0)
        assert top.feedback == "runs a, until 30.0 s of mission time"
        with pytest.raises(Refusal):
            await set_parameter(placer, "limit", "seconds", 0.0)
        await placer.wait(lambda: top.status is FAILURE, within_s=15.0)
        assert 30.0 <= placer.clock.now_s() < 31.0

    placer_world(scene)


# ---------------------------------------------------------------------- lost messages, restarted parents
def test_a_parent_that_missed_a_suspension_hears_of_it_when_it_is_back(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("timeout", "one-minute", node("leaf", "patrol", arc=ARC), seconds=60.0))
        arc = await granted(placer, "patrol")
        await placer.kill("one-minute")
        await arc.suspend("higher", "console-1")
        await placer.clock.sleep_s(10.0)
        top = await placer.restart("one-minute")
        await placer.clock.sleep_s(300.0)
        assert top.suspended_because == "patrol: higher by console-1"
        await placer.kill("one-minute")
        await arc.grant()
        top = await placer.restart("one-minute")
        await placer.clock.sleep_s(5.0)
        assert top.suspended_because == ""
        await placer.wait(lambda: top.status is FAILURE, within_s=65.0)

    placer_world(scene)


def test_a_composite_that_is_restarted_goes_on_with_the_child_it_finds(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        steps = node("sequence", "steps", node("leaf", "a", arc=ARC))
        top = await root(placer, node("timeout", "limit", steps, seconds=60.0))
        arc = await granted(placer, "a")
        leaf = placer.components["a"]
        await arc.suspend()
        await placer.clock.sleep_s(1.0)
        await placer.kill("steps")
        await arc.grant()
        await placer.restart("steps")
        await placer.clock.sleep_s(5.0)
        assert placer.components["a"] is leaf
        assert top.suspended_because == "", "the news of the life before are not the last word"

    placer_world(scene)


def test_a_start_waits_for_the_stop_before_it(placer_world: Run) -> None:
    """The robot comes and goes while a stop is under way, which must not end the child that is wanted again."""

    async def scene(placer: FakePlacer) -> None:
        first, second = node("leaf", "first", arc=ARC), node("leaf", "second")
        await root(placer, node("fallback", "watch", first, second, while_suspended="next", patience_s=0.0))
        arc = await granted(placer, "first")
        await arc.suspend()
        await placer.wait(lambda: "second" in placer.components)
        await placer.clock.sleep_s(1.0)
        stood_in = placer.components["second"]
        placer.stop_takes_s["second"] = 3.0
        await arc.grant()
        await placer.clock.sleep_s(1.0)
        await arc.suspend()
        await placer.wait(lambda: placer.components.get("second") not in (None, stood_in), within_s=10.0)
        await placer.clock.sleep_s(20.0)
        assert is_running(placer, "watch", "first", "second")

    placer_world(scene)


def test_a_parent_that_finishes_while_it_waits_for_a_stop_starts_no_other_child(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("sequence", "steps", node("leaf", "a"), node("leaf", "b")))
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        placer.components["a"].finish(SUCCESS)
        await placer.clock.sleep_s(2.0)
        top.finish(FAILURE)
        placer.speak()
        await placer.clock.sleep_s(20.0)
        assert (is_running(placer, "steps"), placer.started) == (True, ["steps", "a"])

    placer_world(scene)


# ---------------------------------------------------------------------- conditions
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
    ],
)
def test_a_condition_that_cannot_be_is_refused(parameters: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        MessageConditionParameters(**parameters)
