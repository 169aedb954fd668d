"""All behaviors that drive, in one room at once; three of them share one video frequency in turns."""

from __future__ import annotations

from typing import Any

import pytest
from behaviors_at_work import at_work, example, filmed_at, wait_until

from backbone.bus.clock import run_virtual
from backbone.component.messages import Parameters, SetParameter, WrongParameter
from mission_control.behavior import Behavior
from mission_control.messages import BehaviorStatus

END = ("jump-scout2", "servo-scout3", "hide-scout4", "return-scout5")
SHARE = END[1:]


@pytest.mark.slow
def test_each_reaches_its_aim_over_several_slices_and_no_two_are_on_the_air() -> None:
    async def scene() -> None:
        async with at_work(example("patrol-scout1", *END)) as running:
            behaviors = {name: running.component(name) for name in END}

            def are_all_done() -> bool:
                return all(isinstance(one, Behavior) and one.status.is_final for one in behaviors.values())

            await wait_until(running, are_all_done, 300.0)
            for name, behavior in behaviors.items():
                assert isinstance(behavior, Behavior)
                assert behavior.status is BehaviorStatus.SUCCESS, f"{name}: {behavior.payload}"
            assert sum(behaviors[name].statistics()["times_suspended"] for name in SHARE) >= 3
            patrol = running.component("patrol-scout1")
            assert patrol.statistics()["waypoints_reached"] >= 8
            world = await running.statistics("world")
            assert world["jammed_frames"] == world["stale_packets"] == 0

    run_virtual(scene())


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [
        ("patrol-scout1", "waypoints", "2,2 3,2"),
        ("jump-scout2", "attempts", 1),
        ("servo-scout3", "stop_m", 0.6),
        ("hide-scout4", "dark_level", 40.0),
        ("return-scout5", "near", "1.5,4.5"),
    ],
)
def test_a_parameter_can_be_changed_at_work_and_nonsense_changes_nothing(name: str, parameter: str, value: Any) -> None:
    async def scene() -> None:
        async with at_work(filmed_at(example(name), 5.0)) as running:
            at = running.component(name).address
            await running.clock.sleep_s(2.0)
            told = await running.bus.ask(at, SetParameter(parameter, value), Parameters, within_s=1.0)
            assert told.values[parameter] == value
            await running.clock.sleep_s(1.0)
            with pytest.raises(WrongParameter):
                await running.bus.ask(at, SetParameter(parameter, -1), Parameters, within_s=1.0)
            assert getattr(running.component(name).parameters, parameter) == value

    run_virtual(scene())
