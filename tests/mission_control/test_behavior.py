"""A behavior among an ARC, a placer, a parent and children, in one process on virtual time."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any, ClassVar

import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.launcher.messages import BranchTaken, TakeBranch
from backbone.mission.behavior_orders import behavior_order
from backbone.placer.messages import Ended, NoHost, StopComponent
from mission_control.behavior import Behavior, NotAChild
from mission_control.children import Decision
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus, ChildReport, ReportNoted
from resource_pool.arc_client import EmergencyStopped, Frame, Noted, NotMyArc, Resumed, StopState
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop

ARC = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
Run = Callable[[Callable[[FakePlacer], Awaitable[None]]], None]


async def stop(placer: FakePlacer, name: str) -> None:
    """Stop a component as an operator does."""
    operator = placer.network.join("ui_console/cli", placer.clock)
    await operator.ask("backbone/placer", StopComponent(name, "by command"), Ended, within_s=5.0)
    await operator.close()


class Watcher(Behavior[Any]):
    """Writes down all it hears."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.heard: list[Any] = []

    async def start(self) -> None:
        self.heard.append("start")

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        self.heard.append(("resumed", dict(rcs)))

    async def suspending(self, deadline_s: float) -> None:
        self.heard.append(("suspending", deadline_s))

    async def suspended(self, reason: str, by: str) -> None:
        self.heard.append(("suspended", reason, by))

    def see(self, frame: Frame) -> None:
        self.heard.append(("frame", frame.epoch, frame.number))


class Parent(Behavior[Any]):
    """Decides by a list."""

    decisions: ClassVar[list[Decision]] = []

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.finished: list[tuple[str, BehaviorStatus, dict[str, Any]]] = []

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, Any]) -> Decision:
        self.finished.append((child, status, dict(payload)))
        return self.decisions[len(self.finished) - 1]


class Sequence(Parent):
    children_together = False


class Driver(Behavior[Any]):
    """Drives while it may."""

    async def act(self) -> None:
        while True:
            await self.arc.drive(4.0, 4.0)
            await self.clock.sleep_s(0.1)


class Spectator(Behavior[Any]):
    """Only looks."""


CLASSES: dict[str, type[Component[Any]]] = {
    "spectator": Spectator,
    "watcher": Watcher,
    "parent": Parent,
    "sequence": Sequence,
    "driver": Driver,
}


def node(name: str, kind: str = "watcher", priority: int = 3, **rest: Any) -> dict[str, Any]:
    return {"type": kind, "name": name, "priority": priority, **rest}


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    """Run a scene with a placer on a fresh network."""

    @asynccontextmanager
    async def placer() -> AsyncIterator[FakePlacer]:
        async with local_mission("iros2001") as network:
            made = FakePlacer(network, VirtualClock(), CLASSES)
            try:
                yield made
            finally:
                await made.close()

    def run(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def main() -> None:
            async with placer() as made:
                await scene(made)

        run_virtual(main())

    return run


async def root(placer: FakePlacer, behavior: dict[str, Any]) -> Any:
    return await placer.launch(behavior_order(behavior, [("iros2001", 10)]))


def test_a_behavior_claims_its_arc_with_its_path_wish_and_run_time(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        asked = placer.arcs["watch1-capture"].parameters
        assert asked["owner"] == "mission_control/watch1"
        assert asked["path"] == [["iros2001", 10], ["watch1", 3]]
        assert (asked["wish"], asked["minimum_runtime_s"], asked["console"]) == ({"scout": "scout1"}, 5.0, False)

    placer_world(scene)


def test_it_keeps_its_state_over_fifty_suspensions_and_hears_by_whom(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        for turn in range(50):
            await arc.grant()
            assert watcher.rcs == {"scout": "scout1", "framegrabber": "grabber1"}
            arc.publish(b"\0" * 4, 2, 2, turn)
            await placer.clock.sleep_s(0.1)
            await arc.suspend("higher", f"console-{turn}", deadline_s=0.0)
            assert watcher.rcs == {}
            arc.publish(b"\0" * 4, 2, 2, 1000)
            await placer.clock.sleep_s(0.1)
        assert placer.components["watch1"] is watcher
        assert watcher.heard.count("start") == 1
        assert [heard for heard in watcher.heard if heard[0] == "frame"] == [("frame", n + 1, n) for n in range(50)]
        suspensions = [heard for heard in watcher.heard if heard[0] == "suspended"]
        assert suspensions == [("suspended", "higher", f"console-{turn}") for turn in range(50)]
        assert placer.started == ["watch1", "watch1-capture"]

    placer_world(scene)


def test_before_the_end_of_a_slice_it_may_stop_cleanly(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        await arc.suspend("slice", "watch2-capture", deadline_s=0.2)
        assert watcher.heard[-2:] == [("suspending", 0.2), ("suspended", "slice", "watch2-capture")]

    placer_world(scene)


def test_only_a_behavior_that_commands_nothing_lets_its_slice_end_without_being_asked(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        for name, kind in (("looks", "spectator"), ("drives", "driver"), ("brakes", "watcher")):
            await root(placer, node(name, kind, arc=ARC))
        await placer.wait(lambda: len(placer.arcs) == 3)
        at_once = {arc: claimed.parameters["stops_at_once"] for arc, claimed in placer.arcs.items()}
        assert at_once == {"looks-capture": True, "drives-capture": False, "brakes-capture": False}

    placer_world(scene)


def test_an_arc_that_died_is_claimed_again(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["watch1-capture"].grant()
        await placer.kill("watch1-capture")
        await placer.wait(lambda: placer.arcs)
        assert watcher.heard[-1] == ("suspended", "lost", "watch1-capture")
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        arc.publish(b"\0" * 4, 2, 2, 7)
        await placer.wait(lambda: watcher.heard[-1] == ("frame", 1, 7))

    placer_world(scene)


def test_an_arc_its_creator_restarted_at_once_is_not_claimed_again_but_the_lost_grant_is_heard(
    placer_world: Run,
) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        await arc.grant()
        await placer.kill("watch1-capture")
        again = await placer.restart("watch1-capture")
        again.epoch = arc.epoch
        await again.grant()
        assert [heard[0] for heard in watcher.heard[-3:]] == ["resumed", "suspended", "resumed"]
        await placer.clock.sleep_s(3.0)
        assert placer.started.count("watch1-capture") == 2

    placer_world(scene)


def test_a_notice_missed_while_the_arc_was_out_of_sight_is_made_up_for(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        watcher = await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["watch1-capture"].grant()
        await placer.kill("watch1-capture")
        await placer.restart("watch1-capture")
        await placer.wait(lambda: watcher.heard[-1] == ("suspended", "slice", "other"))

    placer_world(scene)


def test_an_arc_left_from_an_earlier_life_is_ended_and_claimed_anew(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        old = placer.arcs["watch1-capture"]
        await placer.kill("watch1")
        await placer.restart("watch1")
        await placer.wait(lambda: placer.arcs.get("watch1-capture") not in (None, old))
        assert placer.ended == ["watch1-capture"]

    placer_world(scene)


def test_a_notice_of_a_foreign_arc_is_refused(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        with pytest.raises(NotMyArc):
            await placer.bus.ask("mission_control/watch1", Resumed("other", {}, {}, 1.0), Noted, within_s=1.0)

    placer_world(scene)


def test_it_acts_only_while_it_holds_the_robot(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        for _ in range(3):
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            await arc.suspend()
            count = len(arc.commands)
            await placer.clock.sleep_s(1.0)
            assert len(arc.commands) == count
        assert {epoch for _at_s, epoch, _command in arc.commands} == {1, 2, 3}
        assert len(arc.commands) >= 27

    placer_world(scene)


def test_a_command_that_came_too_late_ends_acting_quietly(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        driver = await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        await arc.grant()
        arc.granted = False
        await placer.clock.sleep_s(1.0)
        assert placer.components["driver"] is driver
        await arc.grant()
        await placer.wait(lambda: arc.commands and arc.commands[-1][1] == 2)

    placer_world(scene)


def test_while_an_operators_stop_stands_it_says_so_and_acts_again_when_it_is_lifted(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        latch = StopLatch("scout1")
        latch.stop("anna", "child in the room", 0.0)
        robot = placer.network.join("resource_pool/scout1", placer.clock)

        async def answer(_asked: Any) -> StopState:
            return latch.state

        robot.serve(robot.source, AskStop, answer)
        robot.declare_alive(robot.source)
        driver = await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        arc.refusal = EmergencyStopped("scout1 was stopped by anna: child in the room", rc="scout1")
        await arc.grant()
        await placer.clock.sleep_s(3.0)
        assert driver.feedback == "scout1 was stopped by anna: child in the room"
        assert not arc.commands
        arc.refusal = None
        latch.lift(1, "ben", placer.clock.now_s())
        robot.publish(robot.source, Conversation.EVENTS, latch.state)
        await placer.wait(lambda: arc.commands, within_s=0.5)
        assert driver.feedback.startswith("holds scout scout1")
        await robot.close()

    placer_world(scene)


def test_a_stop_it_never_heard_of_and_that_is_lifted_already_costs_it_one_command(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        latch = StopLatch("scout1")
        latch.stop("anna", "child in the room", 0.0)
        latch.lift(1, "anna", 1.0)
        robot = placer.network.join("resource_pool/scout1", placer.clock)

        async def answer(_asked: Any) -> StopState:
            return latch.state

        robot.serve(robot.source, AskStop, answer)
        robot.declare_alive(robot.source)
        await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        arc.require = lambda command: latch.require_moving(command.after_stop)
        await arc.grant()
        await placer.wait(lambda: arc.commands, within_s=0.5)
        assert [command.after_stop for _at_s, _epoch, command in arc.commands] == [1]
        await robot.close()

    placer_world(scene)


def test_told_to_stop_it_gives_its_arc_back(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("watch1", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["watch1-capture"]
        placer.components["watch1"].end("test")
        await placer.wait(lambda: not placer.components)
        assert arc.released
        assert placer.ended == ["watch1-capture"]

    placer_world(scene)


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


def test_a_root_that_cannot_claim_its_arc_is_reported(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        placer.refusals["capture"] = NoHost("no host has tag gl")
        top = await root(placer, node("top", arc=ARC))
        await placer.wait(lambda: top.status.is_final)
        [absence] = top.absences()
        assert (absence.name, absence.cause, absence.doing) == ("top", "no host has tag gl", "")

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


def test_a_claim_that_is_refused_for_a_moment_is_made_again(placer_world: Run) -> None:
    """Its host was just coming back, say; the first claim of a life is no last word."""

    async def scene(placer: FakePlacer) -> None:
        placer.refusals["capture"] = NoHost("its creator is gone")
        top = await root(placer, node("top", arc=ARC))
        await placer.clock.sleep_s(2.0)
        assert [absence.name for absence in top.absences()] == ["top-capture"]
        del placer.refusals["capture"]
        await placer.clock.sleep_s(10.0)
        assert top.status is BehaviorStatus.RUNNING
        assert top.absences() == []

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
        placer.fall_often("leaf")
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
        report = ChildReport("leaf", BehaviorStatus.SUCCESS)
        with pytest.raises(NotAChild):
            await placer.bus.ask("mission_control/top", report, ReportNoted, within_s=1.0)

    placer_world(scene)


async def take(placer: FakePlacer, version: int, top: dict[str, Any], *anew: str) -> BranchTaken:
    """Tell a root its place in a changed tree, as the launcher does."""
    placed = behavior_order(top, [("iros2001", 10)]).parameters
    place = {name: placed[name] for name in ("path", "arc", "children")}
    at = f"mission_control/{top['name']}"
    return await placer.bus.ask(at, TakeBranch(version, place, list(anew)), BranchTaken, within_s=5.0)


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
        top.finish(BehaviorStatus.SUCCESS)
        await placer.wait(lambda: placer.ended == ["a"])
        assert await take(placer, 1, node("top", "parent", 5, children=[node("b")])) == BranchTaken("success")
        await placer.clock.sleep_s(5.0)
        assert "b" not in placer.started

    placer_world(scene)


def test_it_tells_how_far_it_is_and_draws_its_branch(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("top", "parent", 5, children=[node("leaf")]))
        await placer.wait(lambda: "leaf" in placer.components)
        state = await placer.bus.ask("mission_control/top", AskBehavior(), BehaviorState, within_s=1.0)
        assert state.status is BehaviorStatus.RUNNING
        assert state.tree.splitlines()[1] == "└─ leaf (watcher, priority 3): running"

    placer_world(scene)


def test_parameters_that_do_not_fit_are_refused_before_anything_runs(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        with pytest.raises(Refusal):
            await root(placer, node("leaf", parameters={"color": "red"}))

    placer_world(scene)


@pytest.mark.processes
def test_a_behaviors_process_loads_neither_pydantic_nor_a_screen() -> None:
    check = (
        "import sys, mission_control.behaviors.watch_for_motion, mission_control.behaviors.surveillance;"
        "import mission_control.behaviors.fallback, mission_control.behaviors.condition;"
        "sys.exit(', '.join({'pydantic', 'typer', 'textual', 'rich', 'mujoco', 'lxml'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
