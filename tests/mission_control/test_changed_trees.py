"""A tree that is changed while its behaviors run."""

from __future__ import annotations

from typing import Any

import pytest
from behaviors_of_a_placer import ARC, Spectator, node, root
from fake_resource_pool import FakePlacer, Run

from backbone.addresses import LAUNCHER
from backbone.launcher.messages import BranchTaken, TakeBranch
from backbone.mission.behavior_orders import behavior_order
from mission_control.messages import BehaviorStatus, NotYourOrder


async def take(
    placer: FakePlacer, version: int, top: dict[str, Any], *anew: str, source: str = LAUNCHER
) -> BranchTaken:
    """Tell a root its place in a changed tree, as the launcher does."""
    placed = behavior_order(top, [("iros2001", 10)]).parameters
    place = {name: placed[name] for name in ("path", "arc", "children")}
    at = f"mission_control/{top['name']}"
    bus = placer.network.join(source, placer.clock)
    try:
        return await bus.ask(at, TakeBranch(version, place, list(anew)), BranchTaken, within_s=5.0)
    finally:
        await bus.close()


def test_a_changed_tree_ends_what_is_gone_begins_what_is_new_and_leaves_the_rest(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", 5, children=[node("a"), node("b", arc=ARC)]))
        await placer.wait(lambda: placer.arcs and "a" in placer.components)
        b = placer.components["b"]
        placer.stop_takes_s["a"] = 2.0
        changed = node("top", "parent", 6, children=[node("c"), node("b", arc=ARC, priority=7)])
        assert await take(placer, 1, changed) == BranchTaken()
        assert "a" not in placer.components, "the answer comes when it has ended"
        await placer.wait(lambda: "c" in placer.components)
        assert placer.components["b"] is b
        assert placer.placed["c"].parameters["path"] == [["iros2001", 10], ["top", 6], ["c", 3]]
        assert top.children == {"b": BehaviorStatus.RUNNING, "c": BehaviorStatus.RUNNING}
        assert not top.absences()

    placer_world(scene)


def test_a_message_about_the_tree_that_comes_again_or_late_changes_nothing(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        changed = node("top", "parent", 5, children=[node("a", "spectator")])
        for _ in range(2):
            await take(placer, 2, changed, "a")
        await take(placer, 1, node("top", "parent", 5, children=[]))
        await placer.wait(lambda: isinstance(placer.components.get("a"), Spectator))
        assert (placer.started, placer.ended) == (["top", "a", "a"], ["a"])

    placer_world(scene)


def test_a_child_that_is_missing_is_started_as_the_tree_is_now(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        await take(placer, 1, node("top", "parent", 5, children=[node("a", children=[node("leaf")])]))
        placer.lose("a")
        await placer.kill("a")
        await placer.wait(lambda: "leaf" in placer.components)

    placer_world(scene)


def test_a_claim_is_made_as_the_tree_is_now(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await take(placer, 1, node("watch1", arc={**ARC, "minimum_runtime_s": 7.0}, priority=9))
        await placer.kill("watch1-capture")
        await placer.wait(lambda: placer.arcs)
        asked = placer.arcs["watch1-capture"].parameters
        assert (asked["minimum_runtime_s"], asked["path"][-1]) == (7.0, ["watch1", 9])

    placer_world(scene)


def test_a_parent_that_has_finished_says_so_and_starts_nothing(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", 5, children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        top.finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: placer.ended == ["a"])
        assert await take(placer, 1, node("top", "parent", 5, children=[node("b")])) == BranchTaken("success")
        await placer.clock.sleep_s(5.0)
        assert "b" not in placer.started

    placer_world(scene)


def test_a_behavior_takes_its_place_from_the_launcher_only(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", 5, children=[node("a")]))
        await placer.wait(lambda: "a" in placer.components)
        with pytest.raises(NotYourOrder):
            await take(placer, 2**53, node("top", "parent", 5, children=[]), source="ui_console/operator-1")
        await take(placer, 1, node("top", "parent", 5, children=[node("b")]))
        await placer.wait(lambda: "b" in placer.components)
        assert list(top.children) == ["b"]

    placer_world(scene)
