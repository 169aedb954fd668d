"""All behaviors that drive, in one room at once; three of them share one video frequency in turns."""

from __future__ import annotations

import pytest
from behaviors_at_work import at_work, example, wait_until

from backbone.bus.clock import run_virtual
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
