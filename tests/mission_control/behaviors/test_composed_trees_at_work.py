"""Composed trees of real components, with a placer that decides nothing and ARCs that come and go, on virtual time."""

from __future__ import annotations

import pytest
from fake_resource_pool import FakePlacer, Run
from trees_of_components import (
    ARC,
    FAILURE,
    SUCCESS,
    ended,
    granted,
    is_running,
    node,
    root,
    set_parameter,
    tree_of,
)

from backbone.errors import Refusal
from backbone.placer.messages import Ended, NoHost, StopComponent
from mission_control.messages import BehaviorStatus


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


def test_the_fall_of_a_child_is_no_attempt_and_its_parent_shows_the_restarts(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("retry", "try", node("leaf", "a"), num_attempts=2))
        await placer.clock.sleep_s(0.1)
        for how in ("signal 9", "exit code 1: ValueError: boom"):
            await placer.kill("a")
            placer.fall("a", how)
            await placer.restart("a")
        restarts = "restarted 2 times, last after exit code 1: ValueError: boom"
        await placer.wait(lambda: top.feedback == f"runs a, attempt 1 of 2; a was {restarts}")
        assert (await tree_of(placer, "try"))[-1] == f"└─ a (leaf, priority 3): running, {restarts}"
        await placer.kill("a")
        placer.fall("a", "exit code 1: ValueError: boom", often=True)
        await placer.wait(lambda: is_running(placer, "try", "a"))
        await placer.wait(
            lambda: (
                top.feedback == "runs a, attempt 2 of 2, because a failed: "
                "a fell too often: exit code 1: ValueError: boom"
            )
        )

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
