"""A driver that hangs is exchanged: the new one does its call."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from driver_bench import Bench
from pool_on_local_network import Pool
from test_swapping_drivers import AT, DRIVERS, PAIRS, bench, shine, swap

from backbone.rc_manager.messages import Disconnect, Disconnected


@pytest.fixture(autouse=True)
def _fresh_bench() -> None:
    Bench.clear()


@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_the_new_driver_does_a_call_that_hangs_in_the_old_one(local_mission: Any, old: str, new: str) -> None:
    """Otherwise only a restart of the RC replaces a driver that hangs."""

    async def scene(pool: Pool) -> None:
        Bench.fault = "stuck"
        hanging = asyncio.create_task(shine(pool, 0.6))
        await pool.clock.sleep_s(0.1)
        swapping = asyncio.create_task(swap(pool, new))
        await pool.clock.sleep_s(0.1)
        Bench.fault = ""
        await hanging
        assert Bench.shone[-1] == (new, 0.6)
        assert (await swapping).is_proved
        assert Bench.opened == [new]

    bench(local_mission, old, scene)


@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_a_call_that_hangs_although_it_is_cancelled_ends_the_exchange(local_mission: Any, old: str, new: str) -> None:
    """Otherwise all further calls wait, and the exchange ends no sooner than the hold."""

    async def scene(pool: Pool) -> None:
        await shine(pool, 0.5)
        Bench.fault = "deaf"
        hanging = asyncio.create_task(shine(pool, 0.6))
        await pool.clock.sleep_s(0.1)
        swapping = asyncio.create_task(swap(pool, new))
        await pool.clock.sleep_s(1.0)
        Bench.fault = ""
        await shine(pool, 0.7)
        assert Bench.shone[-1] == (old, 0.7)
        swapped = await asyncio.wait_for(swapping, 5.0)
        assert not swapped.is_proved
        assert f"a call of {DRIVERS}:{old} hangs, even if it is cancelled" in swapped.cause
        assert "'scout-backbone stop lamp1'" in swapped.cause
        assert Bench.opened in ([], [old]), "the old one was neither closed nor opened again"
        Bench.end_deaf.set()
        await asyncio.gather(hanging, return_exceptions=True)
        await pool.manager_voice.ask(AT, Disconnect("one", 1), Disconnected, within_s=1)
        assert Bench.shone[-1] == (old, 0.0)
        assert (await swap(pool, new)).is_proved

    bench(local_mission, old, scene)
