"""What the owner of an ARC may, hears and loses."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import ROBOTS, state_of

from backbone.bus.clock import run_virtual
from resource_pool.commands import Drive, Halt
from resource_pool.messages import Accepted, Applied, NotYours, Release, Suspended, SwappedOut


def test_the_arc_of_a_dead_owner_withdraws_and_ends_within_a_second(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _, arc = await pool.console("console", "drive", "scout1")
            await arc.wait_granted()
            await pool.kill("console")
            async with asyncio.timeout(1.0):
                assert await pool.outcome(arc.arc) is None
                while (await state_of(pool, "scout1")).holders:
                    await pool.clock.sleep_s(0.01)

    run_virtual(main())


def test_the_rcs_of_a_hung_owner_go_to_the_next(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            hung, _ = await pool.owner("hung"), None
            first = await pool.arc(hung, "drive", "scout1", minimum_runtime_s=60.0)
            await first.wait_granted()
            second = await pool.arc(await pool.owner("next"), "drive", "scout1")
            await pool.clock.sleep_s(1.0)
            assert second.granted is None
            hung.hangs = True
            async with asyncio.timeout(4.0):
                await second.wait_granted()
            assert pool.is_alive(first.arc)
            hung.hangs = False

    run_virtual(main())


def test_release_ends_the_arc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner, arc = await pool.console("console", "drive", "scout1")
            await arc.wait_granted()
            await owner.bus.ask(arc.address, Release("enough"), Accepted, within_s=1)
            async with asyncio.timeout(1.0):
                assert await pool.outcome(arc.arc) is None

    run_virtual(main())


def test_only_the_owner_commands_its_arc(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            await arc.wait_granted()
            stranger = await pool.owner("stranger")
            for what, answer in [(Drive(1.0, 1.0), Applied), (Halt(), Applied), (Release(), Accepted)]:
                with pytest.raises(NotYours):
                    await stranger.bus.ask(arc.address, what, answer, within_s=1)
            assert (await arc.state()).granted

    run_virtual(main())


def test_a_swapped_out_owner_is_told_why_by_whom_and_until_when(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            arc = await pool.arc(owner, "drive", "scout1")
            await arc.wait_granted()
            _, console = await pool.console("console", "drive", "scout1")
            await console.wait_granted()
            with pytest.raises(SwappedOut) as refused:
                await arc.drive(1.0, 1.0)
            assert refused.value.facts["reason"] == "higher"
            assert refused.value.facts["by"] == "console-drive"
            assert "expected_start_s" in refused.value.facts
            suspended = owner.notices[-1]
            assert isinstance(suspended, Suspended)
            assert (suspended.reason, suspended.by) == ("higher", "console-drive")

    run_virtual(main())


def test_a_command_before_the_first_grant_is_refused_like_any_other(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "drive", "scout1")
            for act in (arc.halt, arc.jump):
                with pytest.raises(SwappedOut) as refused:
                    await act()
                assert refused.value.facts["reason"] == "waiting"
            assert pool.is_alive(arc.arc)
            await pool.kill(arc.arc)

    run_virtual(main())


def test_notices_reach_even_a_slow_owner_in_the_order_of_the_switches(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            owner = await pool.owner("watcher")
            owner.slow_s = 0.8
            arc = await pool.arc(owner, "drive", "scout1")
            while not (await state_of(pool, "scout1")).holders:
                await pool.clock.sleep_s(0.01)
            await pool.clock.sleep_s(0.05)
            _, console = await pool.console("console", "drive", "scout1")
            await console.wait_granted()
            await pool.clock.sleep_s(3.0)
            assert owner.heard() == ["Resumed", "Suspended"]
            assert arc.granted is None

    run_virtual(main())
