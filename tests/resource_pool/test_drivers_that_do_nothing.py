"""A driver that does nothing while it is on trial has not proved itself."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from driver_bench import Bench
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from backbone.exchange import SwapClass, Swapped
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected
from backbone.scheduling.requests import RcUse
from resource_pool.commands import Tune
from resource_pool.messages import Applied

AT = "resource_pool/camera"
LINKS = {"video_frequency": ["video"]}


def camera(**parameters: Any) -> Resource:
    return Resource(
        "camera", "framegrabber", driver="exchanged_drivers:FirstCamera", links=LINKS, parameters=parameters
    )


async def tuned(pool: Pool, epoch: int) -> None:
    await pool.manager_voice.ask(AT, Connect("one", epoch, 30.0, RcUse(), {}), Connected, within_s=1)
    await pool.voice("one").ask(AT, Tune("video", "").under("one", epoch), Applied, within_s=1)


async def swap(pool: Pool, prove_s: float = 1.0) -> Swapped:
    asked = SwapClass("exchanged_drivers:SecondCamera", {}, prove_s, 2.0, user="anna")
    return await pool.voice_of("ui_console/tester").ask(AT, asked, Swapped, within_s=60.0)


@pytest.fixture(autouse=True)
def _fresh_bench() -> None:
    Bench.clear()


@pytest.mark.parametrize("prove_s", [0.5, 5.0])
@pytest.mark.parametrize("frame_rate_hz", [15.0, 0.5])
def test_a_camera_without_a_picture_fails_its_trial(local_mission: Any, prove_s: float, frame_rate_hz: float) -> None:
    async def main() -> None:
        hardware = [camera(frame_rate_hz=frame_rate_hz)]
        async with a_pool(local_mission, ["camera"], manager=False, hardware=hardware) as pool:
            await tuned(pool, 1)
            Bench.fault = "mute"
            swapped = await swap(pool, prove_s)
            assert (swapped.is_proved, "no picture" in swapped.cause) == (False, True)
            assert Bench.tuned == {"FirstCamera": "video"}
            Bench.fault = ""
            assert (await swap(pool)).is_proved

    run_virtual(main())


def test_a_camera_that_no_one_watches_is_not_blamed(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["camera"], manager=False, hardware=[camera()]) as pool:
            Bench.fault = "mute"
            assert (await swap(pool)).is_proved

    run_virtual(main())


@pytest.mark.parametrize("is_mute", [False, True])
def test_a_camera_that_is_handed_over_at_the_end_of_its_trial_has_time_for_a_picture(
    local_mission: Any, is_mute: bool
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["camera"], manager=False, hardware=[camera()]) as pool:
            Bench.fault = "mute" if is_mute else ""
            swapping = asyncio.create_task(swap(pool))
            await pool.clock.sleep_s(1.45)
            await tuned(pool, 1)
            await pool.clock.sleep_s(0.02)
            await pool.manager_voice.ask(AT, Disconnect("one", 1), Disconnected, within_s=1)
            await tuned(pool, 2)
            assert (await swapping).is_proved is not is_mute

    run_virtual(main())


def test_a_protocol_that_encoded_nothing_is_told_of(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            asked = SwapClass("exchanged_drivers:LoudProtocol", {}, 1.0, 2.0)
            voice = pool.voice_of("ui_console/tester")
            swapped = await voice.ask("resource_pool/scout1", asked, Swapped, within_s=60.0)
            assert (swapped.is_proved, swapped.rounds) == (True, 0)
            assert "nothing was asked of the new driver" in swapped.remark

    run_virtual(main())
