"""Conditions on what an RC measures: asked for, heard, never there; and a battery that brings a robot home."""

from __future__ import annotations

import math
import random
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from behaviors_at_work import EXAMPLES, at_work, pose
from examples import share
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from backbone.mission.model import MissionDescription
from backbone.mission.reader import MissionInvalid, read_mission
from backbone.wire import Envelope, Message
from mission_control.behaviors.condition import FIRST_READINGS_S, MessageCondition, MessageConditionParameters
from mission_control.laboratory.simulation.whole_mission import RunningMission
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus
from resource_pool.messages import AskReadings, Readings
from resource_pool.rc_readings import ask_readings
from resource_pool.stop_messages import AskStop

RC = "resource_pool/scout1"
RUNNING, SUCCESS, FAILURE = BehaviorStatus.RUNNING, BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE
LOW = {"source": "scout1", "message": "Readings", "field": "values.battery_share", "below": 0.3}
BATTERY = EXAMPLES / "battery.xml"
HOME_M = (1.0, 1.0)
WAY_HOME_S = 45.0  # 5 m from the farthest way point at 0.2 m/s, two turns, and starting a patrol
SEEDS, QUICK_SEEDS = 20, 1


class Scene:
    """A condition on readings that has just started, and the RC that it asks."""

    def __init__(self, placer: FakePlacer) -> None:
        self.placer, self.clock = placer, placer.clock
        self.bus = placer.network.join(RC, placer.clock)
        self.readings, self.asked = Readings("scout1", -1.0), 0
        self.condition: Any = None

    def answer(self, accepts: type[Message] = AskReadings) -> None:
        """Answer from now on."""
        self.bus.serve(RC, accepts, self._answer)

    def measure(self, charge: float) -> None:
        self.readings = Readings("scout1", self.clock.now_s(), {"battery_share": charge})

    def publish(self, charge: float) -> None:
        self.measure(charge)
        self.bus.publish(RC, Conversation.READINGS, self.readings)

    async def begin(self, **parameters: Any) -> None:
        tree = {"type": "condition", "name": "low", "priority": 3, "children": [], "arc": None}
        order = behavior_order({**tree, "parameters": {**LOW, **parameters}}, [("iros2001", 10)])
        self.condition = await self.placer.launch(order)

    async def after(self, seconds: float) -> tuple[BehaviorStatus, str]:
        await self.clock.sleep_s(seconds)
        return self.condition.status, self.condition.payload.get("detail", "")

    async def _answer(self, _asked: Envelope[Any]) -> Message:
        self.asked += 1
        return self.readings


Play = Callable[[Callable[[Scene], Awaitable[None]]], None]


@pytest.fixture
def play(local_mission: Any) -> Play:
    @asynccontextmanager
    async def placed() -> AsyncIterator[FakePlacer]:
        async with local_mission("iros2001") as network:
            placer = FakePlacer(network, VirtualClock(), {"condition": MessageCondition})
            try:
                yield placer
            finally:
                await placer.close()

    def run(script: Callable[[Scene], Awaitable[None]]) -> None:
        async def main() -> None:
            async with placed() as placer:
                scene = Scene(placer)
                await script(scene)
                await scene.bus.close()

        run_virtual(main())

    return run


@pytest.mark.parametrize(
    ("charge", "outcome"),
    [
        (0.25, (SUCCESS, "values.battery_share is 0.25")),
        (0.3, (FAILURE, "values.battery_share is 0.3, wanted: values.battery_share below 0.3")),
    ],
)
def test_a_check_asks_once_and_decides(play: Play, charge: float, outcome: tuple[BehaviorStatus, str]) -> None:
    async def script(scene: Scene) -> None:
        scene.measure(charge)
        scene.answer()
        await scene.begin(mode="check", source=RC)
        assert await scene.after(0.1) == outcome
        await scene.clock.sleep_s(5.0)
        assert scene.asked == 1

    play(script)


def test_a_wait_hears_the_first_reading_that_is_as_stated(play: Play) -> None:
    async def script(scene: Scene) -> None:
        scene.measure(0.9)
        scene.answer()
        await scene.begin()
        for charge in (0.8, 0.31, 0.3):
            scene.publish(charge)
            assert await scene.after(0.1) == (RUNNING, "")
        scene.publish(0.29)
        assert await scene.after(0.1) == (SUCCESS, "values.battery_share is 0.29")

    play(script)


def test_a_wait_asks_too_so_that_a_lost_publication_costs_a_second(play: Play) -> None:
    async def script(scene: Scene) -> None:
        await scene.begin()
        assert await scene.after(30.0) == (RUNNING, ""), "an RC that is not there yet"
        scene.measure(0.1)
        scene.answer()
        assert await scene.after(1.1) == (SUCCESS, "values.battery_share is 0.1")

    play(script)


def test_a_check_waits_for_the_first_readings_and_fails_if_there_are_none(play: Play) -> None:
    async def late(scene: Scene) -> None:
        scene.answer()
        await scene.begin(mode="check")
        assert await scene.after(FIRST_READINGS_S - 1.0) == (RUNNING, "")
        scene.publish(0.1)
        assert await scene.after(0.1) == (SUCCESS, "values.battery_share is 0.1")

    async def never(scene: Scene) -> None:
        scene.answer()
        await scene.begin(mode="check", field="", below=None)
        assert await scene.after(FIRST_READINGS_S + 0.1) == (FAILURE, "scout1 had no readings within 5 s")

    play(late)
    play(never)


def test_a_check_set_at_run_time_waits_for_the_first_readings_from_then_on(play: Play) -> None:
    """Otherwise the tree waits for ever for an RC without readings."""

    async def script(scene: Scene) -> None:
        scene.answer()
        await scene.begin()
        assert await scene.after(10.0) == (RUNNING, "")
        scene.condition.change_parameters({"mode": "check"})
        assert await scene.after(FIRST_READINGS_S - 0.1) == (RUNNING, "")
        scene.condition.change_parameters({"below": 0.2})
        assert await scene.after(FIRST_READINGS_S - 0.1) == (RUNNING, ""), "the new comparison has its whole time"
        assert await scene.after(0.2) == (FAILURE, "scout1 had no readings within 5 s")

    play(script)


def test_a_check_that_is_set_to_wait_waits_for_ever(play: Play) -> None:
    async def script(scene: Scene) -> None:
        scene.answer()
        await scene.begin(mode="check")
        scene.condition.change_parameters({"mode": "wait"})
        assert await scene.after(10.0 * FIRST_READINGS_S) == (RUNNING, "")

    play(script)


def test_a_value_that_an_rc_does_not_report_is_missing(play: Play) -> None:
    async def script(scene: Scene) -> None:
        scene.measure(0.1)
        scene.answer()
        await scene.begin(mode="check", field="values.charge")
        assert await scene.after(0.1) == (FAILURE, "values.charge is missing, wanted: values.charge below 0.3")

    play(script)


def test_an_rc_without_readings_ends_the_condition(play: Play) -> None:
    async def script(scene: Scene) -> None:
        scene.answer(AskStop)
        await scene.begin()
        await scene.clock.sleep_s(0.1)
        assert (scene.condition.status, scene.condition.payload["code"]) == (FAILURE, "wire.unknown")

    play(script)


@pytest.mark.parametrize("source", ["*", "mission_control/scout1", "backbone/scout1"])
def test_readings_have_one_source_in_the_resource_pool(source: str) -> None:
    with pytest.raises(ValueError, match="name the RC whose readings are asked for"):
        MessageConditionParameters(message="Readings", source=source)


@pytest.mark.parametrize(
    ("right", "wrong", "fault"),
    [
        ('value="scout1"', 'value="scuot1"', "no resource is named 'scuot1' (did you mean 'scout1'?)"),
        ('value="scout1"', 'value="radio"', "radio has no readings"),
        (
            "values.battery_share",
            "values.batery_share",
            "readings of scout1 have no 'values.batery_share' (did you mean 'values.battery_share'?)",
        ),
        (
            "values.battery_share",
            "battery_share",
            "readings of scout1 have no 'battery_share' (did you mean 'values.battery_share'?)",
        ),
        ('name="below" value="0.3"', 'name="below" value="30"', "battery_share of scout1 is always below 30"),
        ('name="below" value="0.3"', 'name="above" value="30"', "battery_share of scout1 is never above 30"),
        ('name="below" value="0.3"', 'name="above" value="1"', "battery_share of scout1 is never above 1"),
        ('name="below" value="0.3"', 'name="below" value="0"', "battery_share of scout1 is never below 0"),
        ('name="below" value="0.3"', 'name="above" value="-1"', "battery_share of scout1 is always above -1"),
    ],
)
def test_a_condition_on_what_no_rc_reports_is_a_fault_with_its_line(
    tmp_path: Path, right: str, wrong: str, fault: str
) -> None:
    before, found, after = BATTERY.read_text().rpartition(right)
    assert found
    path = tmp_path / "battery.xml"
    path.write_text(before + wrong + after)
    with pytest.raises(MissionInvalid) as caught:
        read_mission(path)
    [only] = caught.value.faults
    assert (only.message, only.line) == (fault, before.count("\n") + 1)


def _battery_mission(folder: Path, seed: int) -> MissionDescription:
    """Return the example with another room, another beginning and another battery."""
    chance = random.Random(seed)
    x_m, y_m, heading_deg = chance.uniform(0.5, 5.5), chance.uniform(0.5, 5.5), chance.uniform(-180.0, 180.0)
    body = (
        f'x-m="{x_m:.3f}" y-m="{y_m:.3f}" heading-deg="{heading_deg:.1f}" battery-j="{chance.uniform(50.0, 90.0):.1f}"'
    )
    text = BATTERY.read_text()
    for written, other in (
        ('seed="1"', f'seed="{seed}"'),
        ('x-m="1.0" y-m="1.0" heading-deg="0" battery-j="60"', body),
    ):
        assert written in text
        text = text.replace(written, other)
    path = folder / f"battery-{seed}.xml"
    path.write_text(text)
    return read_mission(path)


async def _outing(running: RunningMission) -> BehaviorState:
    return await running.bus.ask("mission_control/outing", AskBehavior(), BehaviorState, within_s=1.0)


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=[pytest.mark.thorough] * (seed >= QUICK_SEEDS)) for seed in range(share(SEEDS))]
)
def test_a_low_battery_brings_the_robot_home_before_it_is_empty(tmp_path: Path, seed: int) -> None:
    async def main() -> None:
        async with at_work(_battery_mission(tmp_path, seed)) as running:
            while not running.hosts.knows("go-home"):
                assert running.clock.now_s() < 600.0, (await _outing(running)).tree
                await running.clock.sleep_s(0.5)
            left_s = running.clock.now_s()
            assert (await ask_readings(running.bus, "scout1")).values["battery_share"] == pytest.approx(0.3, abs=0.02)
            while not (state := await _outing(running)).status.is_final:
                assert running.clock.now_s() < left_s + WAY_HOME_S, state.tree
                await running.clock.sleep_s(0.5)
            at, charge = await pose(running, "scout1"), await ask_readings(running.bus, "scout1")
        assert state.status is SUCCESS
        assert math.dist((at.x_m, at.y_m), HOME_M) < 0.15
        assert 0.05 < charge.values["battery_share"] < 0.3

    run_virtual(main())
