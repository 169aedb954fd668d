"""An RC takes no order that its RC manager cannot have given, and is as before."""

from __future__ import annotations

from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import AskRc, Connect, Connected, Disconnect, Disconnected, RcState, most_epoch
from backbone.scheduling.requests import RcUse
from resource_pool.messages import ImpossibleUse

GRABBER = address(Subsystem.RESOURCE_POOL, "grabber")


async def state_of(pool: Pool) -> RcState:
    return await pool.ear.ask(GRABBER, AskRc(), RcState, within_s=1)


@pytest.mark.parametrize("epoch", [2**64 - 1, 2**53, 10**9])
def test_an_epoch_that_nobody_can_have_given_is_refused_and_the_next_grant_is_taken(
    local_mission: Any, epoch: int
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            before = await state_of(pool)
            with pytest.raises(ImpossibleUse, match=str(epoch)):
                await pool.manager_voice.ask(GRABBER, Disconnect("one", epoch), Disconnected, within_s=1)
            order = Connect("one", epoch, 2.0, RcUse(), {})
            with pytest.raises(ImpossibleUse, match=str(epoch)):
                await pool.manager_voice.ask(GRABBER, order, Connected, within_s=1)
            assert await state_of(pool) == before
            grant = Connect("one", before.last_epoch + 1, 2.0, RcUse(), {})
            await pool.manager_voice.ask(GRABBER, grant, Connected, within_s=1)

    run_virtual(main())


def test_the_largest_plausible_epoch_is_taken_and_the_one_after_it_too(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            most = most_epoch(pool.clock.now_s())
            await pool.manager_voice.ask(GRABBER, Disconnect("one", most), Disconnected, within_s=1)
            await pool.clock.sleep_s(0.1)
            order = Connect("one", most + 1, 2.0, RcUse(), {})
            await pool.manager_voice.ask(GRABBER, order, Connected, within_s=1)

    run_virtual(main())


@pytest.mark.parametrize("lease_s", [1e9, 3_600.1, float("inf"), float("nan"), 0.0, -1.0])
def test_a_lease_that_is_none_is_refused(local_mission: Any, lease_s: float) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            epoch = (await state_of(pool)).last_epoch + 1
            order = Connect("one", epoch, lease_s, RcUse(), {})
            with pytest.raises(ImpossibleUse, match="lease"):
                await pool.manager_voice.ask(GRABBER, order, Connected, within_s=1)
            assert (await state_of(pool)).holders == []

    run_virtual(main())
