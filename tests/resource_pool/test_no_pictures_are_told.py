"""A framegrabber that holds a frequency and delivers nothing says so: else a mission watches nothing and looks well."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool
from pool_orders import at, connect, disconnect

from backbone.bus.clock import run_virtual
from backbone.component.messages import AskState, ComponentState, StoryEvent
from backbone.keys import Conversation
from resource_pool.commands import Tune
from resource_pool.messages import Applied


async def _tune(pool: Pool, arc: str, epoch: int) -> None:
    await connect(pool, "grabber", arc, epoch, lease_s=20.0)
    await pool.voice(arc).ask(at("grabber"), Tune("video", robot="scout1").under(arc, epoch), Applied, within_s=1)


async def _why(pool: Pool) -> list[str]:
    state = await pool.ear.ask(at("grabber"), AskState(), ComponentState, within_s=1)
    return [absence.cause for absence in state.absent if absence.is_running]


@pytest.mark.parametrize(
    ("transmitters", "why"),
    [
        (None, "its device delivers none"),
        (0, "no robot transmits"),
        (2, "several robots transmit at once"),
    ],
)
def test_an_arc_that_no_picture_reaches_is_told_until_pictures_come(
    local_mission: Any, transmitters: int | None, why: str
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            told: list[str] = []
            pool.ear.subscribe(at("grabber"), Conversation.LOG, StoryEvent, lambda heard: told.append(heard.body.what))
            driver = pool.grabber_driver

            async def play(transmitters: int | None, seconds: float) -> None:
                for _ in range(int(seconds / 0.1)):
                    if transmitters is not None and driver.deliver is not None:
                        driver.deliver(dataclasses.replace(driver.picture(), transmitters=transmitters))
                    await pool.clock.sleep_s(0.1)

            await _tune(pool, "one", 1)
            assert await _why(pool) == []
            await play(transmitters, 1.9)
            assert await _why(pool) == []
            await play(transmitters, 1.0)
            assert await _why(pool) == [f"no picture reaches its ARC: {why}"]
            await disconnect(pool, "grabber", "one", 1)
            assert await _why(pool) == []
            await _tune(pool, "one", 2)
            await play(transmitters, 3.0)
            assert told == [f"no picture reaches one: {why}"], "once, and not in each slice"
            await play(1, 0.5)
            assert await _why(pool) == []
            assert told[1:] == ["pictures reach one again"]

    run_virtual(main())
