"""How a parent takes the ends and failures of its children."""

from __future__ import annotations

import pytest
from behaviors_of_a_placer import ARC, Parent, node, root, stop
from fake_resource_pool import FakePlacer, Run

from backbone.placer.messages import NoHost
from mission_control.children import Decision
from mission_control.messages import BehaviorStatus, ChildReport, NotAChild, ReportNoted


def test_a_childs_end_is_told_to_a_parent_that_was_away(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.NEXT]
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        leaf = placer.components["leaf"]
        await placer.kill("top")
        leaf.finish(BehaviorStatus.FAILURE, {"why": "tired"})
        top = await placer.restart("top")
        await placer.wait(lambda: top.finished)
        assert top.finished == [("leaf", BehaviorStatus.FAILURE, {"why": "tired"})]

    placer_world(scene)


def test_a_finished_child_is_retried_when_its_parent_decides_so(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.RETRY, Decision.NEXT]
        top = await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        first = placer.components["leaf"]
        first.finish(BehaviorStatus.FAILURE, {"why": "tired"})
        await placer.wait(lambda: placer.components.get("leaf") not in (None, first))
        placer.components["leaf"].finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: top.status.is_final)
        assert top.status is BehaviorStatus.SUCCESS
        assert [status for _child, status, _payload in top.finished] == ["failure", "success"]

    placer_world(scene)


def test_a_child_whose_stop_takes_long_holds_up_no_other(placer_world: Run) -> None:
    """The host of one child does not answer; the parent starts the other one again meanwhile."""

    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.RETRY, Decision.RETRY]
        await root(placer, node("top", "parent", 5, children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= set(placer.components))
        placer.stop_takes_s["a"] = 20.0
        placer.components["a"].finish(BehaviorStatus.FAILURE)
        await placer.clock.sleep_s(1.0)
        first = placer.components["b"]
        first.finish(BehaviorStatus.FAILURE)
        await placer.wait(lambda: placer.components.get("b") not in (None, first), within_s=3.0)
        await placer.wait(lambda: placer.started.count("a") == 2, within_s=30.0)

    placer_world(scene)


def test_an_order_to_stop_a_child_is_repeated_until_the_placer_takes_it(placer_world: Run) -> None:
    """A hub that was away for a moment left children driving for ever."""

    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.ABORT]
        await root(placer, node("top", "parent", 5, children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= set(placer.components))
        placer.silence()
        placer.components["a"].finish(BehaviorStatus.FAILURE, {"why": "tired"})
        await placer.clock.sleep_s(5.0)
        assert "b" in placer.components
        placer.speak()
        await placer.wait(lambda: set(placer.components) == {"top"}, within_s=5.0)

    placer_world(scene)


def test_an_aborting_parent_ends_the_other_children_and_fails_with_the_reason(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.ABORT]
        top = await root(placer, node("top", "parent", 5, children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= set(placer.components))
        placer.components["a"].finish(BehaviorStatus.FAILURE, {"code": "x"})
        await placer.wait(lambda: set(placer.components) == {"top"})
        assert (top.status, top.payload) == (BehaviorStatus.FAILURE, {"child": "a", "code": "x"})
        assert [absence.name for absence in top.absences()] == ["a"], "a tree that gave up is not healthy"

    placer_world(scene)


def test_a_claim_that_can_never_be_served_fails_the_child_and_the_parent_hears_why(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.ABORT]
        placer.refusals["capture"] = NoHost("no host has tag gl")
        top = await root(placer, node("top", "parent", 5, children=[node("leaf", arc=ARC)]))
        await placer.wait(lambda: top.finished)
        [(child, status, payload)] = top.finished
        assert (child, status, payload["code"]) == ("leaf", BehaviorStatus.FAILURE, "placer.no_host")

    placer_world(scene)


def test_a_child_that_cannot_be_started_counts_as_failed(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.ABORT]
        placer.refusals["watcher"] = NoHost("no host")
        top = await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: top.status is BehaviorStatus.FAILURE)
        assert top.payload["code"] == "placer.no_host"

    placer_world(scene)


def test_a_child_that_falls_too_often_counts_as_failed(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.ABORT]
        top = await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        await placer.clock.sleep_s(0.1)
        await placer.kill("leaf")
        placer.fall("leaf", often=True)
        await placer.wait(lambda: top.status is BehaviorStatus.FAILURE)
        assert top.payload["code"] == "child.given_up"

    placer_world(scene)


def test_a_child_stopped_by_the_operator_is_left_alone(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.RETRY]
        top = await root(placer, node("top", "parent", 5, children=[node("a"), node("b")]))
        await placer.wait(lambda: {"a", "b"} <= set(placer.components))
        await stop(placer, "a")
        await placer.wait(lambda: "a" not in top.children)
        assert set(placer.components) == {"top", "b"}
        assert top.status is BehaviorStatus.RUNNING

    placer_world(scene)


def test_a_child_that_a_parent_goes_on_without_is_reported_with_its_cause(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        Parent.decisions = [Decision.NEXT]
        placer.refusals["capture"] = NoHost("no host has tag gl")
        top = await root(placer, node("top", "parent", 5, children=[node("leaf", arc=ARC), node("other")]))
        await placer.wait(lambda: top.component_state().absent)
        [absence] = top.component_state().absent
        assert (absence.name, absence.cause, absence.doing) == ("leaf", "no host has tag gl", "")
        assert "scout-backbone story leaf" in absence.remedy

    placer_world(scene)


def test_only_children_may_report(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        report = ChildReport("leaf", BehaviorStatus.SUCCESS)
        with pytest.raises(NotAChild):
            await placer.bus.ask("mission_control/top", report, ReportNoted, within_s=1.0)

    placer_world(scene)
