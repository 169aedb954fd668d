"""A robot that was reset, or missed the packet, has its transmitter off: its ARC switches it on again."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.naming import Subsystem, address
from resource_pool.arc_client import ArcClient
from resource_pool.messages import Accepted, NotFromYou, NothingHeard
from resource_pool.rcs.framegrabber import SILENT_S
from scout_model.radio_link import encode_transmitter_on

EVERYTHING = ["scout1", "radio", "video", "grabber"]
FRAME_S = 0.1


async def watching(pool: Pool) -> ArcClient:
    arc = await pool.arc(await pool.owner("watcher"), "capture", "scout1")
    await arc.wait_granted()
    return arc


async def deliver_for(pool: Pool, seconds: float, transmitters: int) -> None:
    for _ in range(round(seconds / FRAME_S)):
        assert pool.grabber_driver.deliver is not None
        pool.grabber_driver.deliver(pool.grabber_driver.picture(transmitters))
        await pool.clock.sleep_s(FRAME_S)


def times_switched_on(pool: Pool) -> int:
    return [heard.payload for heard in pool.radio_driver.heard_by(1)].count(encode_transmitter_on("video"))


def test_a_transmitter_that_fell_silent_is_switched_on_again(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            await watching(pool)
            await deliver_for(pool, 1.0, 1)
            assert times_switched_on(pool) == 1
            await deliver_for(pool, SILENT_S + 3 * FRAME_S, 0)
            assert times_switched_on(pool) == 2
            await deliver_for(pool, 2 * SILENT_S, 1)
            assert times_switched_on(pool) == 2

    run_virtual(main())


def test_a_picture_missed_now_and_then_is_no_silence(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            await watching(pool)
            for _ in range(5):
                await deliver_for(pool, SILENT_S - 2 * FRAME_S, 0)
                await deliver_for(pool, FRAME_S, 1)
            assert times_switched_on(pool) == 1

    run_virtual(main())


@pytest.mark.parametrize("stranger", ["mission_control/watcher", "resource_pool/scout1", "backbone/rc_manager"])
def test_only_its_framegrabber_says_what_an_arc_does_not_see(local_mission: Any, stranger: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            arc = await watching(pool)
            assert arc.granted is not None
            said = NothingHeard("grabber", arc.granted.epochs["grabber"])
            with pytest.raises(NotFromYou):
                await pool.voice_of(stranger).ask(arc.address, said, Accepted, within_s=1)
            grabber = pool.voice_of(address(Subsystem.RESOURCE_POOL, "grabber"))
            await grabber.ask(arc.address, NothingHeard("grabber", said.epoch - 1), Accepted, within_s=1)
            await pool.clock.sleep_s(0.5)
            assert times_switched_on(pool) == 1

    run_virtual(main())
