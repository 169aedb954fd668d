"""Drives, jumps and halts: what the robot that is held does, and when its wheels stop."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import ROBOTS, at, command, connect, disconnect

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from backbone.rc_manager.messages import StaleEpoch
from backbone.wire import Envelope
from resource_pool.commands import Drive
from resource_pool.messages import LoadPacket, PacketLoaded
from scout_model.radio_link import encode_drive, encode_halt, encode_safe


def test_a_drive_command_turns_the_wheels_of_the_robot_that_is_held(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            before, other = await pool.pose("scout1"), await pool.pose("scout2")
            for _ in range(10):
                applied = await arc.drive(8.0, 8.0)
                await pool.clock.sleep_s(0.1)
            assert applied.values == {"left_rad_s": 8.0, "right_rad_s": 8.0}
            after = await pool.pose("scout1")
            assert after[0] - before[0] > 0.1
            assert await pool.pose("scout2") == pytest.approx(other, abs=1e-3)
            assert pool.audit["stale_packets"] == 0

    run_virtual(main())


def test_a_speed_that_is_no_number_is_refused_and_moves_nothing(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            for speed in (math.nan, math.inf):
                with pytest.raises(Refusal) as refused:
                    await arc.drive(speed, 1.0)
                assert refused.value.code == "scout.not_finite"
            await pool.clock.sleep_s(0.3)
            assert not pool.radio_driver.heard_by(1)

    run_virtual(main())


def test_wheels_stop_when_commands_stay_away(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            await arc.drive(8.0, 8.0)
            commanded_s = pool.clock.now_s()
            await pool.clock.sleep_s(1.0)
            stopped = await pool.pose("scout1")
            await pool.clock.sleep_s(1.0)
            assert await pool.pose("scout1") == pytest.approx(stopped, abs=2e-3)
            halts = [heard.at_s for heard in pool.radio_driver.heard_by(1) if heard.payload == encode_halt()]
            assert commanded_s + 0.5 <= halts[0] <= commanded_s + 0.6
            assert pool.running["scout1"].statistics()["command_timeouts"] == 1

    run_virtual(main())


def test_repeated_commands_keep_the_wheels_turning(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            for _ in range(8):
                await arc.drive(4.0, 4.0)
                await pool.clock.sleep_s(0.4)
            assert pool.running["scout1"].statistics()["command_timeouts"] == 0
            assert {heard.payload for heard in pool.radio_driver.heard_by(1)} == {encode_drive(4.0, 4.0)}

    run_virtual(main())


def test_a_command_that_ends_after_its_hold_leaves_no_dead_man_behind(local_mission: Any) -> None:
    """The robot is taken away while the radio still takes the packet; nothing must spin or halt the next holder."""

    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            radio = pool.network.join(at("radio"), pool.clock)

            async def slow(asked: Envelope[Any]) -> PacketLoaded:
                await pool.clock.sleep_s(0.2)
                return PacketLoaded()

            radio.serve(at("radio"), LoadPacket, slow)
            await connect(pool, "scout1", "one", 1, companions={"radio": 1})
            driving = asyncio.create_task(command(pool, "one", 1, Drive(5.0, 5.0)))
            await pool.clock.sleep_s(0.1)
            await disconnect(pool, "scout1", "one", 1)
            with pytest.raises(StaleEpoch):
                await driving
            await connect(pool, "scout1", "two", 2, companions={"radio": 2})
            await asyncio.wait_for(pool.clock.sleep_s(1.5), 2.0)
            assert pool.running["scout1"].statistics()["command_timeouts"] == 0
            await radio.close()

    run_virtual(main())


def test_a_jump_is_not_called_off_by_packets_repeated_for_the_robots_sake(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [*ROBOTS, "video"]) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "video_drive", "scout1")
            await arc.wait_granted()
            await arc.halt()
            await pool.clock.sleep_s(0.2)
            await arc.jump()
            await pool.clock.sleep_s(1.0)
            heard = [h.payload for h in pool.radio_driver.heard_by(1)]
            later = heard[heard.index(b"J") :]
            assert later.count(b"J") == 1
            assert not {encode_halt(), encode_safe()} & set(later)
            assert len(later) > 10, "the robot must go on hearing that it is not forgotten"
            await arc.drive(1.0, 1.0)
            await pool.clock.sleep_s(0.2)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_drive(1.0, 1.0)

    run_virtual(main())
