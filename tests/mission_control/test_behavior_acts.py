"""A behavior acts while it holds the robot and no stop stands."""

from __future__ import annotations

import re
from typing import Any

import pytest
from behaviors_of_a_placer import ARC, Canceller, Stubborn, node, root
from fake_resource_pool import FakePlacer, Run

from backbone.component.messages import LifeState
from backbone.errors import BackboneError, ReplyTimeout
from backbone.keys import Conversation
from resource_pool.arc_client import EmergencyStopped, StaleEpoch, StopState
from resource_pool.commands import Drive, Halt
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop

STOPPED = EmergencyStopped("scout1 was stopped by anna", rc="scout1")


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


def test_a_command_that_its_rc_refused_because_the_grant_had_ended_ends_acting_quietly(placer_world: Run) -> None:
    """A person who takes the robot over takes its RCs while the ARC still passes a command on."""

    async def scene(placer: FakePlacer) -> None:
        driver = await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        arc.refusal = StaleEpoch("scout1: driver-capture commands under epoch 1, it has no connection")
        await arc.grant()
        await placer.clock.sleep_s(1.0)
        assert placer.components.get("driver") is driver
        await arc.suspend()
        arc.refusal = None
        await arc.grant()
        await placer.wait(lambda: arc.commands and arc.commands[-1][1] == 2)

    placer_world(scene)


def test_a_robot_that_does_not_answer_its_arc_costs_time_and_not_the_behavior(placer_world: Run) -> None:
    """The behavior's process has all of its progress."""

    async def scene(placer: FakePlacer) -> None:
        driver = await root(placer, node("driver", "driver", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["driver-capture"]
        arc.refusal = ReplyTimeout("scout1 did not answer within 0.8 s")
        await arc.grant()
        await placer.clock.sleep_s(2.0)
        arc.refusal = None
        await placer.wait(lambda: arc.commands, within_s=0.5)
        assert placer.components["driver"] is driver

    placer_world(scene)


@pytest.mark.parametrize("obstacle", [ReplyTimeout("scout1 does not answer"), STOPPED], ids=["no answer", "stop"])
def test_if_its_first_command_of_a_grant_fails_it_acts_when_the_obstacle_is_gone(
    placer_world: Run, obstacle: BackboneError
) -> None:
    async def scene(placer: FakePlacer) -> None:
        await root(placer, node("starter", "starter", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["starter-capture"]
        arc.refusal = obstacle
        await arc.grant()
        await placer.clock.sleep_s(2.0)
        arc.refusal = None
        await placer.wait(lambda: len(arc.commands) > 1, within_s=2.0)
        assert [type(command) for _at_s, _epoch, command in arc.commands[:2]] == [Halt, Drive]
        await arc.suspend()
        await arc.grant()
        await placer.clock.sleep_s(0.5)
        assert [type(command) for _at_s, epoch, command in arc.commands if epoch == 2].count(Halt) == 1

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


@pytest.mark.parametrize(("kind", "times"), [("driver", 0), ("stubborn", 1)])
def test_an_act_that_goes_on_after_its_cancellation_is_told_with_its_place(
    placer_world: Run, kind: str, times: int
) -> None:
    async def scene(placer: FakePlacer) -> None:
        own = await root(placer, node("own", kind, arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["own-capture"]
        await arc.grant()
        await placer.clock.sleep_s(1.0)
        await arc.suspend()
        await placer.clock.sleep_s(1.0)
        place = f"({Stubborn.act.__code__.co_filename}, line {Stubborn.act.__code__.co_firstlineno})"
        told = [event.what for event in own.story.of("own") if "cancellation" in event.what]
        assert told == [f"act goes on after its cancellation {place}"] * times

    placer_world(scene)


def test_an_act_that_cancels_itself_is_a_bug_with_its_place(placer_world: Run) -> None:
    """Otherwise the behavior keeps its robot, and neither log nor status has a reason."""

    async def scene(placer: FakePlacer) -> None:
        own = await root(placer, node("own", "canceller", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["own-capture"].grant()
        await placer.wait(lambda: own.state is LifeState.FAILED)
        code = Canceller.act.__code__
        place = f"({code.co_filename}, line {code.co_firstlineno})"
        assert own.feedback == f"RuntimeError: act was cancelled by its own code {place}"

    placer_world(scene)


def test_an_act_that_closes_its_bus_is_a_bug(placer_world: Run) -> None:
    """Otherwise the behavior stays ready and hears nothing."""

    async def scene(placer: FakePlacer) -> None:
        own = await root(placer, node("own", "closer", arc=ARC))
        await placer.wait(lambda: placer.arcs)
        await placer.arcs["own-capture"].grant()
        await placer.wait(lambda: own.state is LifeState.FAILED)
        assert own.feedback.startswith("RuntimeError: only the end of a behavior closes its bus; ")

    placer_world(scene)


@pytest.mark.parametrize(("kind", "is_told"), [("forgetful", True), ("seer", False), ("finisher", False)])
def test_an_act_that_returns_without_finish_is_told(placer_world: Run, kind: str, is_told: bool) -> None:
    """Otherwise the behavior keeps its robot for no visible reason."""
    returned = "act has returned without finish, so the behavior keeps its RCs"

    async def scene(placer: FakePlacer) -> None:
        own = await root(placer, node("own", kind, arc=ARC))
        await placer.wait(lambda: placer.arcs)
        arc = placer.arcs["own-capture"]
        await arc.grant()
        await placer.clock.sleep_s(1.0)
        assert (own.feedback == f"waves; {returned}") is is_told
        if is_told:
            await arc.suspend()
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            assert own.feedback == f"waves; {returned}", "in each turn"
        assert [event.what for event in own.story.of("own")].count(returned) == is_told, "once in the log"

    placer_world(scene)


def test_a_word_as_status_is_a_bug_with_what_to_write(placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        own = await root(placer, node("own", "driver", arc=ARC))
        written = "finish('success'): write BehaviorStatus.SUCCESS or BehaviorStatus.FAILURE"
        with pytest.raises(TypeError, match=re.escape(written)):
            own.finish("success")

    placer_world(scene)
