"""A parameter that changes while a behavior waits for an answer: the work begins anew with it, at any moment."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.mission.behavior_orders import behavior_order
from backbone.wire import Envelope
from mission_control.behaviors.driver import Driver
from mission_control.behaviors.go_to import GoTo
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import AskFloorPlan, AskPose, FloorPlan, Pose

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
