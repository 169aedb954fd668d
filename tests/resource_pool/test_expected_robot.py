"""Whose picture an ARC gets: its own robot's, never another's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pool_on_local_network import a_pool

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import Connect, Connected
from backbone.scheduling.requests import RcUse
from resource_pool.commands import Tune
from resource_pool.messages import Applied, Frame


def test_a_picture_of_another_robot_is_not_delivered_and_one_of_unknown_origin_is_the_expected_ones(
    local_mission: Any,
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            grabber = address(Subsystem.RESOURCE_POOL, "grabber")
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await pool.manager_voice.ask(grabber, Connect("one", 1, 2.0, RcUse(), {}), Connected, within_s=1)
            await pool.voice("one").ask(grabber, Tune("video", "scout1").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            assert driver.deliver is not None
            driver.deliver(replace(driver.picture(), robot="scout2"))
            driver.deliver(replace(driver.picture(), robot="scout1"))
            driver.deliver(replace(driver.picture(), robot="", transmitters=-1))
            await pool.clock.sleep_s(0.01)
            assert [(frame.robot, frame.number) for frame in heard] == [("scout1", 1), ("scout1", 2)]
            statistics = pool.running["grabber"].statistics()
            assert (statistics["frames_delivered"], statistics["frames_foreign"]) == (2, 1)

    run_virtual(main())
