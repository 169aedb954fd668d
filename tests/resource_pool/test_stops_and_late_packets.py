"""A confirmed stop is true: nothing that moves the robot is on the air afterwards."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from pool_on_local_network import Pool, WiretappedRadio, a_pool
from pool_orders import command, connect_robot, disconnect

from backbone.bus.clock import VirtualClock, run_virtual
from resource_pool.arc_client import StopState, stop_robot
from resource_pool.commands import Drive
from resource_pool.messages import COMMAND_TIMEOUT_S
from scout_model.radio_link import encode_drive, encode_halt

FORWARD = encode_drive(3.0, 3.0)


class DelayingRadio(WiretappedRadio):
    """Waits for its device within each call."""

    delay_s = 0.0

    async def transmit(self, *packet: Any, **of: Any) -> Any:
        await asyncio.sleep(self.delay_s)
        return await super().transmit(*packet, **of)


async def stopped(pool: Pool) -> StopState:
    return await stop_robot(pool.voice_of("ui_console/console-1"), "scout1", "a child", "anna")


def drives_after(pool: Pool, since_s: float) -> list[float]:
    """Return the times of the packets that moved the robot since then."""
    return [
        packet.at_s for packet in pool.radio_driver.heard_by(1) if packet.payload == FORWARD and packet.at_s > since_s
    ]


@pytest.mark.parametrize("delay_s", [0.03, 0.2, 0.7, 0.95])
@pytest.mark.parametrize("offset_s", [0.0, 0.02, 0.15])
def test_a_packet_that_a_driver_delays_goes_before_the_stop_is_confirmed(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, delay_s: float, offset_s: float
) -> None:
    monkeypatch.setattr(DelayingRadio, "delay_s", delay_s)

    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            await pool.rc("radio", driver=f"{__name__}:DelayingRadio")
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.21 + offset_s)
            stop = await stopped(pool)
            answered_s = pool.clock.now_s()
            await pool.clock.sleep_s(1.2)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_halt()
            assert not (stop.is_confirmed and drives_after(pool, answered_s))
            assert stop.is_confirmed is (delay_s < 0.9), "a packet that takes longer than the robot waits is in doubt"

    run_virtual(main())


@pytest.mark.parametrize("early_s", [0.0, 0.0007])
@pytest.mark.parametrize("end", ["disconnection", "restart"])
def test_a_stop_without_a_holder_is_confirmed_when_the_radio_repeats_no_former_drive(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, end: str, early_s: float
) -> None:
    """The RC manager disconnects all RCs at once, but the radio may be late, or cut off."""

    async def sleep_until_s(clock: VirtualClock, at_s: float) -> None:
        wait_s = at_s - clock.now_s()
        await clock.sleep_s(wait_s - early_s if wait_s > 0.001 else wait_s)  # uvloop counts whole milliseconds

    monkeypatch.setattr(VirtualClock, "sleep_until_s", sleep_until_s)

    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(0.1)
            if end == "restart":
                await pool.kill("scout1")
                await pool.rc("scout1")
            else:
                await disconnect(pool, "scout1", "one", 1)
            pressed_s = pool.clock.now_s()
            stop, answered_s = await stopped(pool), pool.clock.now_s()
            assert stop.is_confirmed
            assert answered_s <= pressed_s + COMMAND_TIMEOUT_S + 0.01
            await pool.clock.sleep_s(1.0)
            assert drives_after(pool, pressed_s)
            assert not drives_after(pool, answered_s)

    run_virtual(main())


def test_a_robot_that_stood_at_the_end_of_its_hold_is_stopped_for_certain(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(2 * COMMAND_TIMEOUT_S)
            await disconnect(pool, "scout1", "one", 1)
            pressed_s = pool.clock.now_s()
            assert (await stopped(pool)).is_confirmed
            assert pool.clock.now_s() == pressed_s

    run_virtual(main())
