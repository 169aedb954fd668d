"""Pictures arrive under the ARC with the epoch of its grant, and none after it."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import EVERYTHING, at, connect, disconnect

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from backbone.keys import Conversation
from resource_pool.commands import Tune
from resource_pool.messages import Applied, Frame


def test_pictures_arrive_under_the_arc_with_the_epoch_of_the_grant(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "capture", "scout1")
            seen: list[Frame] = []
            await arc.wait_granted()
            frames = arc.frames(seen.append)
            driver = pool.grabber_driver
            assert driver.frequency == "video"
            for _ in range(3):
                driver.deliver(driver.picture())
                await pool.clock.sleep_s(0.05)
            assert [frame.number for frame in seen] == [1, 2, 3]
            assert {frame.epoch for frame in seen} == {arc.granted.epochs["grabber"]}
            frames.close()

    run_virtual(main())


def test_no_picture_arrives_after_the_disconnection_even_if_the_driver_goes_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            late = driver.deliver
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            await disconnect(pool, "grabber", "one", 1)
            late(driver.picture())
            await connect(pool, "grabber", "one", 2)
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            assert [frame.epoch for frame in heard] == [1]
            assert driver.stops >= 1

    run_virtual(main())


def test_garbled_and_silent_pictures_are_counted_and_not_delivered(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            for transmitters in (0, 2, 1, 3, -1, 0):
                driver.deliver(driver.picture(transmitters))
                await pool.clock.sleep_s(0.01)
            statistics = pool.running["grabber"].statistics()
            assert len(heard) == 2
            assert (statistics["frames_delivered"], statistics["frames_garbled"], statistics["frames_silent"]) == (
                2,
                2,
                2,
            )

    run_virtual(main())


def test_a_frequency_the_framegrabber_does_not_receive_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            await connect(pool, "grabber", "one", 1)
            with pytest.raises(Refusal) as refused:
                await pool.voice("one").ask(at("grabber"), Tune("elsewhere").under("one", 1), Applied, within_s=1)
            assert refused.value.code == "framegrabber.frequency"
            assert pool.grabber_driver.deliver is None

    run_virtual(main())
