"""A command given by a behavior: read from the mission file, repeated after an interruption, for its time."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import mujoco
import numpy as np
import pytest
from behaviors_at_work import EXAMPLES, Person, at_work, driving, hear, wait_until
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from backbone.component.messages import Parameters, SetParameter, StoryEvent
from backbone.keys import Conversation
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission
from mission_control.behaviors.give import Give, GiveParameters, read_values
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import BehaviorStatus, WaypointReached
from resource_pool.drivers.world_messages import AskWorld, WorldModel, WorldState
from scout_model.world import STATE

NAMES = st.from_regex(r"[a-z_]{1,12}", fullmatch=True)
VALUES = st.one_of(st.booleans(), st.integers(-(2**31), 2**31), st.floats(allow_nan=False, allow_infinity=False), NAMES)


def written(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


@given(st.dictionaries(NAMES, VALUES))
def test_values_are_read_as_they_were_written(values: dict[str, object]) -> None:
    wanted = {name: {"true": True, "false": False}.get(str(value), value) for name, value in values.items()}
    assert read_values(" ".join(f"{name}={written(value)}" for name, value in values.items())) == wanted


@pytest.mark.parametrize("text", ["pan_rad", "=3", "pan_rad=", "pan_rad = 3"])
def test_what_is_no_value_is_refused_with_a_remedy(text: str) -> None:
    with pytest.raises(ValueError, match="write name=value, separated by blanks"):
        GiveParameters(word="look", values=text)


TEAM = EXAMPLES / "team.xml"
WORLD = "resource_pool/world"
LOOK_RAD, LIFTED_M = 0.6, 0.08


async def joints(running: RunningMission, *names: str) -> Callable[[], list[float]]:
    """Return what returns the present positions of these joints, named ``robot/joint``."""
    known = await running.bus.ask(WORLD, AskWorld(), WorldModel, within_s=5.0)
    model = mujoco.MjModel.from_xml_string(known.mjcf)
    data = mujoco.MjData(model)
    states: list[bytes] = []
    running.bus.subscribe(WORLD, Conversation.BODIES, WorldState, lambda heard: states.append(heard.body.state))

    def positions() -> list[float]:
        if not states:
            return [0.0] * len(names)
        mujoco.mj_setState(model, data, np.frombuffer(states[-1]), STATE)
        return [float(data.joint(name).qpos[0]) for name in names]

    return positions


def lamp_says(running: RunningMission) -> list[str]:
    """Return a list to which each thing that the lamp's driver does will be added."""
    said: list[str] = []
    running.bus.subscribe(
        "resource_pool/lamp1", Conversation.LOG, StoryEvent, lambda heard: said.append(heard.body.what)
    )
    return said


def only(name: str, **parameters: object) -> MissionDescription:
    """Return the mission of the whole team with this behavior alone."""
    mission = read_mission(TEAM)
    [kept] = [behavior for behavior in mission.behaviors if behavior.name == name]
    changed = msgspec.structs.replace(kept, parameters={**kept.parameters, **parameters})
    return msgspec.structs.replace(mission, behaviors=(changed,))


@pytest.mark.thorough
def test_a_whole_team_is_commanded_by_behaviors_on_shared_hardware() -> None:
    async def main() -> None:
        async with at_work(read_mission(TEAM)) as running:
            at = await joints(running, "wall-camera/pan", "rover1/lift")
            steps, looked = hear(running, "walk", WaypointReached), list[int]()
            for looks in (1, -1, 1):  # left, right, and left again
                await wait_until(running, lambda sign=looks: abs(at()[0] - sign * LOOK_RAD) < 0.02, 30.0)
                looked.append(looks)
            await wait_until(running, lambda: at()[1] > LIFTED_M, 90.0)
            await wait_until(running, lambda: at()[1] < LIFTED_M / 10, 20.0)
            assert len(steps) >= 2
            assert "shine" in running.component("light").feedback
            ran = {line["arc"] for line in running.trace if line["ev"] == "grant"}
            assert "watch-capture" in ran  # it had its turn of the frequency between two sweeps

    run_virtual(main())


def test_an_interruption_costs_none_of_its_time_and_the_command_is_given_again() -> None:
    async def main() -> None:
        person = Person()
        async with at_work(only("light", for_s=6.0), person) as running:
            said, began_s = lamp_says(running), running.clock.now_s()
            await running.clock.sleep_s(2.0)
            await person.take_over("scout1", driving(1.0, 1.0, 5.0), kind="lit_drive")
            light = running.component("light")
            assert isinstance(light, Give)
            await wait_until(running, lambda: light.status is BehaviorStatus.SUCCESS, 30.0)
            assert said.count("shines green at 50%") == 2
            assert light.held_s == pytest.approx(6.0)
            assert running.clock.now_s() - began_s > 6.0 + 5.0

    run_virtual(main())


def test_another_command_and_another_time_hold_at_once() -> None:
    async def main() -> None:
        async with at_work(only("light", for_s=3600.0)) as running:
            said, light = lamp_says(running), running.component("light")
            await wait_until(running, lambda: "shines green at 50%" in said, 10.0)
            for parameter, value in (("values", "brightness=0.25"), ("for_s", 1.0)):
                await running.bus.ask(light.address, SetParameter(parameter, value), Parameters, within_s=1.0)
                await running.clock.sleep_s(1.0)
            assert said.count("shines green at 25%") == 1
            assert isinstance(light, Give)
            assert light.status is BehaviorStatus.SUCCESS

    run_virtual(main())


def test_a_command_that_the_arc_does_not_have_is_a_failure_with_the_commands_it_has() -> None:
    async def main() -> None:
        async with at_work(only("light", word="bark")) as running:
            await wait_until(running, lambda: "gives up" in running.component("light").feedback, 10.0)
            assert "it has: " in running.component("light").feedback

    run_virtual(main())
