"""The example of a composed tree at work, in a whole mission in one process."""

from __future__ import annotations

from pathlib import Path

import pytest
from behaviors_at_work import EXAMPLES, Person, at_work, driving, hear

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus, WaypointReached

EXAMPLE: Path = EXAMPLES / "composed.xml"
MOST_S = 400.0


async def _state(running: RunningMission, behavior: str) -> BehaviorState:
    return await running.bus.ask(f"mission_control/{behavior}", AskBehavior(), BehaviorState, within_s=1.0)


async def _end(running: RunningMission) -> BehaviorState:
    while not (state := await _state(running, "outing")).status.is_final:
        assert running.clock.now_s() < MOST_S, state.tree
        await running.clock.sleep_s(1.0)
    return state


@pytest.mark.thorough
def test_it_patrols_and_comes_home_though_a_person_has_the_robot_for_longer_than_the_patrol_may_take() -> None:
    person = Person()

    async def scene() -> None:
        async with at_work(read_mission(EXAMPLE), person) as running:
            reached = hear(running, "patrol", WaypointReached)
            await running.clock.sleep_s(15.0)
            await person.take_over("scout1", driving(2.0, -2.0, lasts_s=70.0))
            state = await _end(running)
        assert state.status is BehaviorStatus.SUCCESS
        assert [event.number for event in reached] == list(range(1, 9)), "the minute ran while the person had the robot"
        lines = state.tree.splitlines()
        assert [line.partition(": ")[2] for line in lines if "look-around" in line] == ["success"]
        assert [line.partition(": ")[2] for line in lines if "end-of-day" in line] == ["success"]

    run_virtual(scene())
