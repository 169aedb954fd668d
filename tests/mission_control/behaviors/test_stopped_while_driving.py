"""A behavior whose robot an operator stops for a while: it draws no conclusion from that time, and goes on after it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from behaviors_at_work import at_work, example, pose, wait_until
from fake_resource_pool import FakeArc, FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from mission_control.behaviors.driver import Driver
from mission_control.behaviors.hide import Hide
from mission_control.behaviors.motion import PATIENCE_S
from mission_control.behaviors.patrol import Patrol
from mission_control.behaviors.servo_to_target import ServoToTarget
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import EmergencyStopped, StopState
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import AskStop, EmergencyStop, LiftStop

ROBOT = "scout1"
PICTURE_S = 0.1
GREY = bytes([128]) * (320 * 240)


async def tell(running: RunningMission, order: EmergencyStop | LiftStop) -> StopState:
    return await running.bus.ask(f"resource_pool/{ROBOT}", order, StopState, within_s=1.0)


def test_a_patrol_drives_on_after_a_stop_and_not_backwards() -> None:
    async def scene() -> None:
        async with at_work(example("patrol-scout1", rounds=1)) as running:
            behavior = running.component("patrol-scout1")
            assert isinstance(behavior, Patrol)
            for place_m in (1.2, 1.4, 1.6, 1.8, 2.0):  # on the way from (1, 1) to (2.5, 1)
                late_s = running.clock.now_s() + 20.0
                while (await pose(running, ROBOT)).x_m < place_m:
                    assert running.clock.now_s() < late_s
                    await running.clock.sleep_s(0.1)
                stop = await tell(running, EmergencyStop("child in the room", "anna"))
                await running.clock.sleep_s(PATIENCE_S + 1.0)
                stood_at = await pose(running, ROBOT)
                await tell(running, LiftStop(stop.number, "anna"))
                for _ in range(5):
                    await running.clock.sleep_s(0.1)
                    assert (await pose(running, ROBOT)).x_m > stood_at.x_m - 0.02
            await wait_until(running, lambda: behavior.status.is_final, 60.0)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert behavior.statistics()["shaken_free"] == 0

    run_virtual(scene())


class StoppedRobot:
    """A robot that an operator has stopped, under a fake ARC."""

    def __init__(self, placer: FakePlacer, arc: FakeArc) -> None:
        self._latch, self._arc, self._clock = StopLatch(ROBOT), arc, placer.clock
        self._latch.stop("anna", "child in the room", 0.0)
        self._bus = placer.network.join(f"resource_pool/{ROBOT}", placer.clock)
        self._bus.serve(self._bus.source, AskStop, self._answer)
        self._bus.declare_alive(self._bus.source)
        arc.refusal = EmergencyStopped(f"{ROBOT} was stopped by anna: child in the room", rc=ROBOT)

    def lift(self) -> None:
        self._arc.refusal = None
        self._latch.lift(1, "anna", self._clock.now_s())
        self._bus.publish(self._bus.source, Conversation.EVENTS, self._latch.state)

    async def close(self) -> None:
        await self._bus.close()

    async def _answer(self, _asked: Any) -> StopState:
        return self._latch.state


@asynccontextmanager
async def held(local_mission: Any, kind: type[Driver[Any]], **parameters: float) -> AsyncIterator[tuple[Any, ...]]:
    """Give a placer, the behavior, and the ARC that has just been granted."""
    async with local_mission("stops") as network:
        placer = FakePlacer(network, VirtualClock(), {"driver": kind})
        need = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": ROBOT}}
        order = {"type": "driver", "name": "driver", "priority": 1, "arc": need, "parameters": parameters}
        behavior = await placer.launch(behavior_order(order, [("stops", 10)]))
        await placer.wait(lambda: placer.arcs)
        [arc] = placer.arcs.values()
        yield placer, behavior, arc
        await placer.close()


@pytest.mark.parametrize(("kind", "parameters"), [(ServoToTarget, {"search_turns": 0.25}), (Hide, {"looks": 1})])
def test_pictures_of_a_stopped_robot_are_no_search(
    local_mission: Any, kind: type[Driver[Any]], parameters: dict[str, float]
) -> None:
    async def scene() -> None:
        async with held(local_mission, kind, **parameters) as (placer, behavior, arc):

            async def film(lasts_s: float) -> None:
                until_s = placer.clock.now_s() + lasts_s
                while placer.clock.now_s() < until_s:
                    arc.publish(GREY, 320, 240)
                    await placer.clock.sleep_s(PICTURE_S)

            robot = StoppedRobot(placer, arc)
            await arc.grant()
            await film(12.0)
            robot.lift()
            await film(2.0)
            assert not behavior.status.is_final
            await film(28.0)  # now it turns round
            assert behavior.status is BehaviorStatus.FAILURE
            await robot.close()

    run_virtual(scene())
