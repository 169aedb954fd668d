"""RCs make themselves safe when their lease is over."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import ROBOTS, at, command, connect, connect_robot, disconnect, drive_always, state_of

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from backbone.rc_manager.messages import StaleEpoch
from resource_pool.commands import Drive
from resource_pool.messages import LoadPacket, PacketLoaded, SwappedOut
from scout_model.radio_link import encode_drive, encode_safe


def test_when_the_rc_manager_dies_for_good_every_rc_makes_itself_safe(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            busy = asyncio.create_task(drive_always(pool, arc, 5))
            await pool.clock.sleep_s(1.0)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(2.1)
            for rc in ROBOTS:
                assert not (await state_of(pool, rc)).holders, rc
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_safe()
            with pytest.raises(SwappedOut):
                await arc.drive(5.0, 5.0)
            assert pool.running["scout1"].statistics()["lease_ends"] == 1
            busy.cancel()
            await asyncio.gather(busy, return_exceptions=True)

    run_virtual(main())


def test_a_lease_runs_from_the_moment_it_was_given_not_from_its_arrival(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            await connect(pool, "scout1", "one", 1, lease_s=1.0)
            given_s = pool.clock.now_s()
            holder = (await state_of(pool, "scout1")).holders[0]
            assert holder.lease_until_s <= given_s + 1.0
            await pool.clock.sleep_s(1.01)
            assert not (await state_of(pool, "scout1")).holders

    run_virtual(main())


@pytest.mark.parametrize("lease_s", [0.0, -1.0, math.nan, math.inf])
def test_a_lease_that_is_no_span_of_time_is_refused(local_mission: Any, lease_s: float) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            with pytest.raises(Refusal):
                await connect(pool, "scout1", "one", 1, lease_s=lease_s)
            assert not (await state_of(pool, "scout1")).holders

    run_virtual(main())


def test_a_granted_arc_goes_on_through_a_restart_of_the_rc_manager(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            before = await arc.wait_granted()
            await arc.drive(2.0, 2.0)
            await pool.kill("rc_manager")
            await pool.clock.sleep_s(0.5)
            await pool.manager()
            for _ in range(40):
                applied = await arc.drive(2.0, 2.0)
                await pool.clock.sleep_s(0.1)
            assert applied.epoch == before.epochs["scout1"]
            assert owner.heard() == ["Resumed"]
            assert encode_safe() not in {heard.payload for heard in pool.radio_driver.heard}

    run_virtual(main())


def test_no_command_is_obeyed_after_its_lease_while_the_rc_is_busy_with_another_hold(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await connect_robot(pool, "two", 2, scout="scout2")
            await command(pool, "two", 2, Drive(1.0, 1.0), scout="scout2")
            await pool.clock.sleep_s(1.9)
            pool.radio_driver.hangs = True
            ending = asyncio.create_task(disconnect(pool, "radio", "two", 2))  # for 0.4 s
            await pool.clock.sleep_s(0.2)
            packet = LoadPacket("one", 1, 1, encode_drive(3.0, 3.0), encode_safe(), 1, moves=True)
            with pytest.raises(StaleEpoch, match="its lease is over"):
                await pool.voice("scout1").ask(at("radio"), packet, PacketLoaded, within_s=1)
            pool.radio_driver.hangs = False
            await asyncio.gather(ending, return_exceptions=True)

    run_virtual(main())
