"""Deliberative beside reactive: the planner of the example thinks, and meanwhile the follower has its rounds."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import msgspec
import pytest
from test_unit_thread import running

from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from mission_control.modules.graph import Graph, Member
from mission_control.modules.orders import UnitParameters
from mission_control.modules.unit_schedule import Trigger
from mission_control.modules.units_together import UnitsTogether

EXAMPLES = Path(__file__).parents[3] / "docs/examples"


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the module of the example."""
    monkeypatch.syspath_prepend(EXAMPLES)
    import plan

    return plan


def test_the_follower_reaches_the_goal_around_the_wall(plan: Any) -> None:
    modules = {"planner": plan.Planner(), "follower": plan.Follower()}
    graph = Graph({name: [Member(name, module.ports())] for name, module in modules.items()})
    units = UnitsTogether(graph, modules, {"planner": Trigger(0.01), "follower": Trigger(20.0)})
    places: list[Any] = []
    units.listen("place", places.append)
    units.advance(60.0)
    assert places[-1] == plan.Place(*map(float, plan.GOAL))
    assert not plan.WALL & {(round(one.x), round(one.y)) for one in places}


@pytest.mark.processes
async def test_the_follower_acts_while_the_planner_thinks(plan: Any, local_mission: Any, beside: Any) -> None:
    """All in one process; as in the mission file, but with a thread for the planner.

    How long a plan takes is the machine's affair. So no second is counted, but the messages: places before the first
    plan, and plans before the first step.
    """
    units = {
        one.name: msgspec.convert(one.parameters, UnitParameters) for one in read_mission(EXAMPLES / "plan.xml").units
    }
    units["planning"] = msgspec.structs.replace(units.pop("planning"), own_thread=True)  # starts last: all is heard
    start, outputs = plan.Place(*plan.START), Conversation.OUTPUTS
    heard: list[Any] = []
    moved = asyncio.Event()

    def hear(one: Any) -> None:
        if not moved.is_set():
            heard.append(one.body)
        if isinstance(one.body, plan.Place) and one.body != start:
            moved.set()

    async with running(local_mission, beside, units) as bus:
        bus.subscribe("mission_control/planning/plan", outputs, plan.Plan, hear)
        bus.subscribe("mission_control/driving/place", outputs, plan.Place, hear)
        await moved.wait()
    plans = [number for number, one in enumerate(heard) if isinstance(one, plan.Plan)]
    assert len(plans) == 1, "it follows the first plan"
    assert heard[: plans[0]] == [start] * plans[0]
    assert plans[0] > 3, "it has its rounds while the planner thinks"
