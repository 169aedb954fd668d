"""A driver on trial that returns or delivers impossible values does not prove itself: the old one comes back."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from driver_bench import Bench
from exchanged_drivers import FirstCamera
from pool_on_local_network import WiretappedRadio, a_pool
from pool_orders import command, connect_robot

from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from backbone.exchange import SwapClass, Swapped
from backbone.rc_manager.messages import Connect, Connected
from backbone.scheduling.requests import RcUse
from resource_pool.arc_client import stop_robot
from resource_pool.commands import Drive, Tune
from resource_pool.drivers.interface import Picture
from resource_pool.drivers.simulated import SimulatedScoutProtocol
from resource_pool.messages import Applied
from scout_model.radio_link import encode_halt

HERE = "test_wrong_values_of_new_drivers"
WRONG_TIMES = {"nan": float("nan"), "endless": float("inf"), "before": -1.0, "long": 11.0, "none": "soon"}


class WrongClockRadio(WiretappedRadio):
    """Returns an impossible time on the air."""

    async def transmit(self, *packet: Any, **of: Any) -> Any:
        await super().transmit(*packet, **of)
        return WRONG_TIMES[Bench.fault]


class WrongClockAlone(WrongClockRadio):
    opens_beside = False


class TornCamera(FirstCamera):
    """Delivers a picture with fewer pixels than its size says."""

    def _picture(self) -> Picture:
        return Picture(self.site.clock.now_s(), memoryview(b"few"), -7, 5)


class SpeakingProtocol(SimulatedScoutProtocol):
    """Returns a packet that is not of bytes."""

    def drive(self, left_rad_s: float, right_rad_s: float) -> Any:
        return f"drive {left_rad_s} {right_rad_s}"


async def swap(pool: Any, name: str, at: str) -> Swapped:
    asked = SwapClass(f"{HERE}:{name}", {}, 1.0, 2.0, user="anna")
    return await pool.voice_of("ui_console/tester").ask(f"resource_pool/{at}", asked, Swapped, within_s=60.0)


@pytest.fixture(autouse=True)
def _fresh_bench() -> None:
    Bench.clear()


@pytest.mark.parametrize("radio", ["WrongClockRadio", "WrongClockAlone"])
@pytest.mark.parametrize("fault", WRONG_TIMES)
def test_an_impossible_time_on_the_air_brings_the_old_radio_back(local_mission: Any, fault: str, radio: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.5)
            Bench.fault = fault
            swapping = asyncio.create_task(swap(pool, radio, at="radio"))
            for _ in range(5):
                await pool.clock.sleep_s(0.2)
                await command(pool, "one", 1, Drive(3.0, 3.0))
            swapped = await swapping
            assert not swapped.is_proved
            assert "on the air" in swapped.cause
            assert pool.is_alive("radio")
            sent = len(WiretappedRadio.built[0].heard)
            await command(pool, "one", 1, Drive(2.0, 2.0))
            await pool.clock.sleep_s(0.5)
            assert len(WiretappedRadio.built[0].heard) > sent

    run_virtual(main())


def test_a_wrong_picture_brings_the_old_grabber_back(local_mission: Any) -> None:
    camera = Resource(
        "camera", "framegrabber", driver="exchanged_drivers:FirstCamera", links={"video_frequency": ["video"]}
    )

    async def main() -> None:
        async with a_pool(local_mission, ["camera"], manager=False, hardware=[camera]) as pool:
            at = "resource_pool/camera"
            await pool.manager_voice.ask(at, Connect("one", 1, 30.0, RcUse(), {}), Connected, within_s=1)
            await pool.voice("one").ask(at, Tune("video", "").under("one", 1), Applied, within_s=1)
            swapped = await swap(pool, "TornCamera", at="camera")
            assert not swapped.is_proved
            assert "wrong picture" in swapped.cause
            assert Bench.tuned == {"FirstCamera": "video"}
            assert pool.is_alive("camera")

    run_virtual(main())


def test_a_packet_that_is_not_of_bytes_brings_the_old_protocol_back(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await connect_robot(pool, "one", 1)
            swapping = asyncio.create_task(swap(pool, "SpeakingProtocol", at="scout1"))
            await pool.clock.sleep_s(0.2)
            await command(pool, "one", 1, Drive(2.0, 2.0))
            swapped = await swapping
            assert not swapped.is_proved
            assert pool.is_alive("scout1")

    run_virtual(main())


class HangingRadio(WiretappedRadio):
    """Accepts no packet."""

    async def transmit(self, *packet: Any, **of: Any) -> Any:
        await asyncio.Event().wait()


def test_a_packet_that_a_new_radio_did_not_send_is_not_sent_by_the_old_one_after_a_stop(local_mission: Any) -> None:
    """Otherwise a robot that stands drives again for a moment, after its stop was confirmed."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            swapping = asyncio.create_task(swap(pool, "HangingRadio", at="radio"))
            await pool.clock.sleep_s(0.1)
            await stop_robot(pool.voice_of("ui_console/console-1"), "scout1", "a child", "anna")
            stopped_s = pool.clock.now_s()
            assert not (await swapping).is_proved
            await pool.clock.sleep_s(0.5)
            afterwards = [packet.payload for packet in WiretappedRadio.built[0].heard if packet.at_s > stopped_s]
            assert set(afterwards) == {encode_halt()}

    run_virtual(main())
