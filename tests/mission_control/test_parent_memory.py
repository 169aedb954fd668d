"""A parent whose process is killed continues with its running children; a child that is started again begins anew."""

from __future__ import annotations

import msgspec
from behaviors_of_a_placer import node, root, stop
from fake_resource_pool import FakePlacer, Run
from mortal_behaviors import Walker, die

from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior_memory import MOST_RECALLS
from mission_control.messages import BehaviorStatus

SUCCESS, FAILURE, RUNNING = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE, BehaviorStatus.RUNNING


def test_a_parent_that_begins_anew_has_its_children_begin_anew(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "sequence", children=[node("walker", "walker"), node("b")]))
        await placer.wait(lambda: "walker" in placer.components)
        first = placer.components["walker"]
        first.finish(SUCCESS)
        await placer.wait(lambda: "b" in placer.components)
        for _ in range(MOST_RECALLS + 1):
            await die(placer, "top")
        await placer.wait(lambda: placer.components.get("walker") not in (None, first))
        await placer.clock.sleep_s(1.0)
        assert placer.components["walker"].status is RUNNING

    kept_world(scene)


def test_a_killed_sequence_continues_with_its_present_child(kept_world: Run) -> None:
    """It once ended the child and drove the way of the first one again."""

    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "sequence", children=[node("first"), node("second")]))
        await placer.wait(lambda: "first" in placer.components)
        placer.components["first"].finish(SUCCESS)
        await placer.wait(lambda: "second" in placer.components)
        second = placer.components["second"]
        top = await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert (top.children, placer.components["second"]) == ({"first": SUCCESS, "second": RUNNING}, second)
        assert placer.started == ["top", "first", "second", "top"]
        second.finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)

    kept_world(scene)


def test_a_child_that_finishes_while_its_parent_is_away_counts_once(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(
            placer, node("top", "repeat", children=[node("a")], parameters={"num_cycles": 3, "pause_s": 0.0})
        )
        await placer.wait(lambda: "a" in placer.components)
        await placer.kill("top")
        placer.components["a"].finish(SUCCESS)
        await placer.clock.sleep_s(1.0)
        top = await placer.restart("top")
        await placer.wait(lambda: placer.started.count("a") == 2)
        for number in (2, 3):
            await placer.wait(lambda number=number: placer.started.count("a") == number and "a" in placer.components)
            placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)
        assert placer.started.count("a") == 3

    kept_world(scene)


def test_a_parent_killed_while_it_ends_a_child_ends_it_before_the_next_start(kept_world: Run) -> None:
    """Else the finished child was adopted as the next cycle, which so never ran."""

    async def scene(placer: FakePlacer) -> None:
        top = await root(
            placer, node("top", "repeat", children=[node("a")], parameters={"num_cycles": 2, "pause_s": 0.0})
        )
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        placer.components["a"].finish(SUCCESS)
        await placer.clock.sleep_s(1.0)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: placer.started.count("a") == 2 and "a" in placer.components)
        await placer.clock.sleep_s(3.0)
        assert (top.status, placer.started.count("a")) == (RUNNING, 2)
        placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: top.status is SUCCESS)

    kept_world(scene)


def test_a_child_that_its_parent_starts_again_begins_anew(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        again = node("top", "repeat", children=[node("walker", "walker")], parameters={"num_cycles": 2, "pause_s": 0.0})
        await root(placer, again)
        await placer.wait(lambda: "walker" in placer.components)
        first = placer.components["walker"]
        first.step()
        first.finish(SUCCESS)
        await placer.wait(lambda: placer.components.get("walker") not in (None, first))
        await placer.clock.sleep_s(1.0)
        assert (placer.components["walker"].number, Walker.recalled) == (0, [])

    kept_world(scene)


def test_what_is_lost_with_placer_and_creator_carries_on(kept_world: Run) -> None:
    """The owners order all of it again, by the same ids."""

    async def scene(placer: FakePlacer) -> None:
        tree = node("top", "sequence", children=[node("a"), node("walker", "walker")])
        order = msgspec.structs.replace(behavior_order(tree, [("iros2001", 10)]), order_id="1.0")
        await placer.launch(order)
        await placer.wait(lambda: "a" in placer.components)
        placer.components["a"].finish(SUCCESS)
        await placer.wait(lambda: "walker" in placer.components)
        placer.components["walker"].step()
        for name in ("top", "walker"):
            await placer.kill(name)
            placer.lose(name)
        await placer.launch(order)
        await placer.wait(lambda: "walker" in placer.components)
        assert (placer.components["walker"].number, placer.started.count("a")) == (1, 1)

    kept_world(scene)


def test_a_child_that_a_person_stopped_stays_stopped(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= placer.components.keys())
        await stop(placer, "a")
        await placer.wait(lambda: "a" not in top.children)
        await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert placer.started.count("a") == 1

    kept_world(scene)


def test_a_behavior_killed_before_its_parent_knew_its_end_reports_it(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "fallback", children=[node("a", "walker"), node("b")]))
        await placer.wait(lambda: "a" in placer.components)
        await placer.kill("top")
        placer.components["a"].finish(FAILURE, {"detail": "the way is blocked"})
        await placer.clock.sleep_s(1.0)
        await die(placer, "a")
        again = placer.components["a"]
        assert (again.status, again.feedback) == (FAILURE, "finished: failure")
        top = await placer.restart("top")
        await placer.wait(lambda: "b" in placer.components)
        assert top.feedback == "runs b, 2 of 2, because a failed: the way is blocked"

    kept_world(scene)


def test_a_finished_parent_that_is_killed_still_ends_its_children(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "timeout", children=[node("a")], parameters={"seconds": 5.0}))
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        await placer.clock.sleep_s(6.0)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: "a" not in placer.components, within_s=3.0)
        await placer.wait(lambda: top.status is FAILURE, within_s=3.0)
        top = await die(placer, "top")
        await placer.clock.sleep_s(3.0)
        assert (top.status, placer.started.count("a")) == (FAILURE, 1)

    kept_world(scene)


def test_a_behavior_that_finished_by_itself_and_is_killed_still_ends_its_children(kept_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        placer.silence()
        top.finish(SUCCESS)
        await placer.kill("top")
        placer.speak()
        top = await placer.restart("top")
        await placer.wait(lambda: "a" not in placer.components, within_s=3.0)
        assert top.status is SUCCESS

    kept_world(scene)
