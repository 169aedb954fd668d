"""A parent starts its children, keeps them, and finds them again after a restart."""

from __future__ import annotations

from behaviors_of_a_placer import ARC, Parent, node, root, stop
from fake_resource_pool import FakePlacer, Run

from mission_control.children import Decision
from mission_control.messages import BehaviorStatus


def test_a_parent_starts_its_children_with_their_paths_and_ends_them_with_itself(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        children = [node("left", arc=ARC), node("right", priority=4)]
        await root(placer, node("surveillance", "parent", 5, children=children))
        await placer.wait(lambda: {"left", "right"} <= set(placer.components) and placer.arcs)
        path = placer.arcs["left-capture"].parameters["path"]
        assert path == [["iros2001", 10], ["surveillance", 5], ["left", 3]]
        await stop(placer, "surveillance")
        await placer.wait(lambda: not placer.components)
        assert set(placer.ended) == {"surveillance", "left", "right", "left-capture"}

    placer_world(scene)


def test_children_go_on_while_their_parent_is_away(placer_world: Run) -> None:
    """A pause of the parent once ended all its children for good."""

    async def scene(placer: FakePlacer) -> None:
        top = node("middle", "parent", 5, children=[node("leaf")])
        await root(placer, node("top", "parent", 5, children=[top]))
        await placer.wait(lambda: "leaf" in placer.components)
        before = {name: placer.components[name] for name in ("middle", "leaf")}
        await placer.kill("top")
        await placer.clock.sleep_s(30.0)
        assert {name: placer.components[name] for name in ("middle", "leaf")} == before
        top = await placer.restart("top")
        await placer.clock.sleep_s(5.0)
        assert top.children == {"middle": BehaviorStatus.RUNNING}
        assert placer.components["leaf"] is before["leaf"]

    placer_world(scene)


def test_a_signal_that_ends_a_parent_leaves_its_children(placer_world: Run) -> None:
    """SIGTERM from outside is no order to stop: the parent's next life adopts them as they are."""

    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        leaf = placer.components["leaf"]
        placer.components["top"].end("SIGTERM")
        await placer.wait(lambda: "top" not in placer.components)
        await placer.restart("top")
        await placer.clock.sleep_s(3.0)
        assert placer.components["leaf"] is leaf

    placer_world(scene)


def test_a_child_that_is_missing_is_started_again_however_it_ended(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        await placer.clock.sleep_s(1.0)
        first = placer.components["leaf"]
        placer.lose("leaf")
        first.end("in good order")
        await placer.wait(lambda: placer.components.get("leaf") not in (None, first), within_s=3.0)
        await placer.clock.sleep_s(1.0)
        assert top.component_state().absent == []
        assert top.children == {"leaf": BehaviorStatus.RUNNING}

    placer_world(scene)


def test_a_missing_child_waits_for_a_placer_that_is_away_and_is_started_then(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        top = await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        await placer.clock.sleep_s(1.0)
        placer.silence()
        placer.lose("leaf")
        await placer.kill("leaf")
        await placer.clock.sleep_s(20.0)
        assert "leaf" not in placer.components
        placer.speak()
        await placer.wait(lambda: "leaf" in placer.components, within_s=5.0)
        assert top.children == {"leaf": BehaviorStatus.RUNNING}

    placer_world(scene)


def test_a_parents_new_life_ends_the_children_that_it_does_not_start_now(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.NEXT, Decision.NEXT]
        await root(placer, node("top", "sequence", 5, children=[node("first"), node("second")]))
        await placer.wait(lambda: "first" in placer.components)
        placer.components["first"].finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: "second" in placer.components)
        await placer.kill("top")
        placer.memories.clear()  # with it, the second child would go on
        await placer.restart("top")
        await placer.wait(lambda: "second" not in placer.components)
        await placer.wait(lambda: "first" in placer.components)

    placer_world(scene)


def test_a_parent_restarted_at_once_finds_its_children_as_they_were(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.NEXT]
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        leaf = placer.components["leaf"]
        await placer.kill("top")
        top = await placer.restart("top")
        await placer.clock.sleep_s(5.0)
        assert placer.components["leaf"] is leaf
        assert top.children == {"leaf": BehaviorStatus.RUNNING}
        leaf.finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: top.status is BehaviorStatus.SUCCESS)

    placer_world(scene)


def test_children_in_order_run_one_after_the_other(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.NEXT, Decision.NEXT]
        top = await root(placer, node("top", "sequence", 5, children=[node("first"), node("second")]))
        await placer.wait(lambda: "first" in placer.components)
        await placer.clock.sleep_s(1.0)
        assert "second" not in placer.components
        placer.components["first"].finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: "second" in placer.components)
        assert "first" not in placer.components
        placer.components["second"].finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: top.status is BehaviorStatus.SUCCESS)

    placer_world(scene)
