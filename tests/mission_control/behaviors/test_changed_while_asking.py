"""A parameter that changes while a behavior waits for an answer: the work begins anew with it, at any moment."""

from __future__ import annotations

import dataclasses
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from fake_resource_pool import FakeArc, FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.mission.behavior_orders import behavior_order
from backbone.wire import Envelope
from mission_control.behaviors.dark_search import SearchStage
from mission_control.behaviors.driver import Driver
from mission_control.behaviors.give import Give
from mission_control.behaviors.go_to import GoTo
from mission_control.behaviors.hide import Hide
from mission_control.behaviors.jump_over import JumpOver
from mission_control.behaviors.patrol import Patrol
from mission_control.behaviors.servo_to_target import ServoToTarget
from mission_control.messages import BehaviorStatus
from mission_control.vision.servo_law import Stage
from mission_control.vision.visual_servo import ServoStep
from resource_pool.arc_client import Applied, AskFloorPlan, AskPose, FloorPlan, GiveCommand, Halt, Pose

EYE = "resource_pool/eye"
GREY = bytes([128]) * (320 * 240)


class Eye:
    """A localizer that knows where the robot is, and calls ``when_asked`` before the answer to a question."""

    def __init__(self, placer: FakePlacer) -> None:
        self.bus, self.at = placer.network.join(EYE, placer.clock), (0.0, 0.0)
        self.when_asked: dict[type, Callable[[], None]] = {}
        self.bus.serve(EYE, AskPose | AskFloorPlan, self._answer)

    async def _answer(self, asked: Envelope[Any]) -> Pose | FloorPlan:
        self.when_asked.pop(type(asked.body), lambda: None)()
        if isinstance(asked.body, AskFloorPlan):
            return FloorPlan(10.0, 10.0)
        return Pose(asked.body.body, 0.0, *self.at, 0.0)


@asynccontextmanager
async def stand(local_mission: Any, kind: type[Driver[Any]], **parameters: Any) -> AsyncIterator[tuple[Any, ...]]:
    """Give a behavior that has no grant yet, its ARC, the localizer and the placer."""
    async with local_mission("changes") as network:
        placer = FakePlacer(network, VirtualClock(), {"driver": kind})
        eye = Eye(placer)
        need = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
        order = {"type": "driver", "name": "driver", "priority": 1, "arc": need, "parameters": parameters}
        behavior = await placer.launch(behavior_order(order, [("changes", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        yield behavior, arc, eye, placer
        await placer.close()
        await eye.bus.close()


def at_first(behavior: Driver[Any], command: str, act: Callable[[], object]) -> None:
    """Call ``act`` once, while the behavior waits for the answer to its first command of this name."""
    client, acts = behavior.held, [act]
    send = getattr(client, command)

    async def sent(*values: float) -> Applied:
        applied: Applied = await send(*values)
        while acts:
            acts.pop()()
        return applied

    setattr(client, command, sent)


@pytest.mark.parametrize("question", [AskFloorPlan, AskPose])
def test_another_place_while_the_localizer_is_asked_is_where_it_goes(local_mission: Any, question: type) -> None:
    async def scene() -> None:
        async with stand(local_mission, GoTo, localizer="eye", x_m=1.0, y_m=1.0) as (behavior, arc, eye, placer):
            eye.at = (1.0, 1.0)
            eye.when_asked[question] = lambda: behavior.change_parameters({"x_m": 2.0})
            await arc.grant()
            await placer.clock.sleep_s(1.0)
            assert behavior.status is BehaviorStatus.RUNNING
            eye.at = (2.0, 1.0)
            await placer.wait(lambda: behavior.status is BehaviorStatus.SUCCESS, 5.0)
            assert behavior.payload["x_m"] == 2.0

    run_virtual(scene())


def hidden(behavior: Hide) -> None:
    behavior.search.stage = SearchStage.HIDDEN


@pytest.mark.parametrize(
    ("kind", "parameters", "before", "changed"),
    [
        (GoTo, {"localizer": "eye", "x_m": 0.0, "y_m": 0.0}, None, {"x_m": 2.0}),
        (Patrol, {"localizer": "eye", "waypoints": "0,0", "rounds": 1}, None, {"waypoints": "2,0"}),
        (JumpOver, {"localizer": "eye", "front": "-3,0", "heading_deg": 0.0}, None, {"front": "5,0"}),
        (Hide, {}, hidden, {"leg_m": 0.5}),
    ],
)
def test_a_change_while_it_halts_at_the_end_is_no_end(
    local_mission: Any,
    kind: type[Driver[Any]],
    parameters: dict[str, Any],
    before: Callable[[Any], None] | None,
    changed: dict[str, Any],
) -> None:
    async def scene() -> None:
        async with stand(local_mission, kind, **parameters) as (behavior, arc, _eye, placer):
            if before is not None:
                before(behavior)
            at_first(behavior, "halt", lambda: behavior.change_parameters(changed))
            await arc.grant()
            await placer.wait(lambda: halts(arc), 5.0)
            await placer.clock.sleep_s(1.0)
            assert behavior.status is BehaviorStatus.RUNNING, behavior.payload

    run_virtual(scene())


@pytest.mark.parametrize("command", ["move", "halt"])
def test_a_change_at_the_place_before_the_target_is_no_arrival(local_mission: Any, command: str) -> None:
    async def scene() -> None:
        async with stand(local_mission, ServoToTarget) as (behavior, arc, _eye, placer):
            at_first(behavior, command, lambda: behavior.change_parameters({"stop_m": 0.5}))
            next_step = behavior.next_step

            async def arriving() -> ServoStep:
                behavior.next_step = next_step
                step: ServoStep = await next_step()
                return dataclasses.replace(step, stage=Stage.ARRIVED)

            behavior.next_step = arriving
            await arc.grant()
            await placer.clock.sleep_s(0.1)
            arc.publish(GREY, 320, 240)
            await placer.wait(lambda: halts(arc), 5.0)
            await placer.clock.sleep_s(1.0)
            assert behavior.status is BehaviorStatus.RUNNING, behavior.payload

    run_virtual(scene())


def test_a_change_beside_a_picture_begins_the_approach_anew(local_mission: Any) -> None:
    async def scene() -> None:
        async with stand(local_mission, ServoToTarget) as (behavior, arc, _eye, placer):
            see = behavior.see

            def seen(frame: Any) -> None:
                see(frame)
                behavior.change_parameters({"stop_m": 0.5})

            await arc.grant()
            await placer.clock.sleep_s(0.1)
            behavior.see = seen
            arc.publish(GREY, 320, 240)
            await placer.clock.sleep_s(0.1)
            behavior.see = see
            assert not arc.commands
            arc.publish(GREY, 320, 240)
            await placer.wait(lambda: arc.commands, 1.0)

    run_virtual(scene())


def test_a_command_that_changes_while_the_old_one_is_on_its_way_is_given_too(local_mission: Any) -> None:
    async def scene() -> None:
        async with stand(local_mission, Give, word="look", values="pan_rad=1.0") as (behavior, arc, _eye, placer):
            changes: list[dict[str, object]] = [{"values": "pan_rad=2.0"}]

            def required(_command: object) -> None:
                if changes:
                    behavior.change_parameters(changes.pop())

            arc.require = required
            await arc.grant()
            await placer.wait(lambda: behavior.status is BehaviorStatus.SUCCESS, 5.0)
            assert [one["pan_rad"] for one in values_given(arc)] == [1.0, 2.0]

    run_virtual(scene())


def values_given(arc: FakeArc) -> list[dict[str, Any]]:
    return [dict(command.values) for _at_s, _epoch, command in arc.commands if isinstance(command, GiveCommand)]


def halts(arc: FakeArc) -> list[Halt]:
    return [command for _at_s, _epoch, command in arc.commands if isinstance(command, Halt)]
