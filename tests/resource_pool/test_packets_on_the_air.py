"""The radio serves the streams of its robots one packet at a time."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from pool_on_local_network import a_pool
from pool_orders import ROBOTS, command, connect, connect_robot, state_of

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from backbone.scheduling.requests import RcUse, Usage
from resource_pool.commands import Halt, Jump


def test_a_stream_that_joins_is_served_at_once_though_others_have_long_periods(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "slow", 1, "scout1", period_s=10.0)
            await command(pool, "slow", 1, Halt(), "scout1")
            await pool.clock.sleep_s(1.0)
            await connect_robot(pool, "quick", 2, "scout2", period_s=0.05)
            await command(pool, "quick", 2, Halt(), "scout2")
            joined_s = pool.clock.now_s()
            await pool.clock.sleep_s(1.0)
            heard = [packet.at_s for packet in pool.radio_driver.heard_by(2)]
            assert heard[0] - joined_s < 0.01
            assert len(heard) == 20
            assert pool.running["radio"].statistics()["overruns"] == 0

    run_virtual(main())


def test_time_in_which_nothing_was_loaded_is_no_overrun(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            await connect_robot(pool, "one", 1)
            await pool.clock.sleep_s(0.7)
            await command(pool, "one", 1, Halt())
            await pool.clock.sleep_s(0.5)
            assert pool.running["radio"].statistics()["overruns"] == 0

    run_virtual(main())


def test_two_packets_are_never_on_the_air_at_once(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            for number, scout in ((1, "scout1"), (2, "scout2")):
                await connect_robot(pool, f"arc{number}", number, scout, period_s=0.01)
                await command(pool, f"arc{number}", number, Halt(), scout)
            for _ in range(20):
                await command(pool, "arc1", 1, Jump(), "scout1")
                await pool.clock.sleep_s(0.013)
            times = [packet.at_s for packet in pool.radio_driver.heard]
            assert all(later - earlier >= 0.002 - 1e-9 for earlier, later in itertools.pairwise(times))

    run_virtual(main())


def test_a_stream_without_a_period_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS, manager=False) as pool:
            for period_s in (0.0, -1.0, math.nan):
                with pytest.raises(Refusal):
                    await connect(pool, "radio", "one", 1, use=RcUse([Usage(period_s, 0.002)]))
            assert not (await state_of(pool, "radio")).holders
            await connect(pool, "radio", "one", 2, use=RcUse([Usage(0.1, 0.002)]))

    run_virtual(main())
