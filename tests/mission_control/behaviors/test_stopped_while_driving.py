"""A behavior whose robot an operator stops for a while: it draws no conclusion from that time, and goes on after it."""

from __future__ import annotations

from behaviors_at_work import at_work, example, pose, wait_until

from backbone.bus.clock import run_virtual
from mission_control.behaviors.patrol import Patrol
from mission_control.behaviors.patrol_route import PATIENCE_S
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import StopState
from resource_pool.stop_messages import EmergencyStop, LiftStop

ROBOT = "scout1"


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
