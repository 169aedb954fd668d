"""What a restart of the RC manager costs ARCs while something else fails, too."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.rc_manager.messages import Disconnect
from backbone.wire import Envelope, Message
from resource_pool.drivers.interface import HardwareFault
from resource_pool.holds import Hold
from resource_pool.rcs.skeleton import Lamp


class StuckLamp(Lamp):
    """A lamp that cannot be switched off while it is stuck: it refuses, or it does not even answer."""

    is_stuck, hangs = True, False

    async def make_safe(self, hold: Hold) -> None:
        if self.is_stuck:
            raise HardwareFault("its relay sticks")
        await super().make_safe(hold)

    async def answer(self, asked: Envelope[Message]) -> Message:
        if self.is_stuck and self.hangs and isinstance(asked.body, Disconnect):
            await asyncio.Event().wait()
        return await super().answer(asked)


async def restart_the_rc_manager(pool: Pool, after_s: float = 0.4) -> None:
    await pool.clock.sleep_s(after_s)
    await pool.manager()


@pytest.mark.parametrize("hangs", [False, True])
def test_an_rc_that_keeps_the_hold_of_a_dead_arc_costs_nobody_else_a_grant(local_mission: Any, hangs: bool) -> None:
    async def main() -> None:
        async with a_pool(
            local_mission, ["scout1", "scout2", "radio", "lamp1"], rc_classes={"lamp": StuckLamp}
        ) as pool:
            owner, other = await pool.owner("owner"), await pool.owner("other")
            arc = await pool.arc(owner, "drive", "scout1")
            dying = await pool.arc(other, "lit_drive", "scout2")
            await arc.wait_granted()
            await dying.wait_granted()
            lamp = cast("StuckLamp", pool.running["lamp1"])
            lamp.hangs = hangs
            for name in ("rc_manager", dying.arc, "other"):
                await pool.kill(name)
            await restart_the_rc_manager(pool)
            await pool.clock.sleep_s(4.0)
            assert owner.heard() == ["Resumed"]
            lamp.is_stuck = False
            again = await pool.owner("again")
            lit = await pool.arc(again, "lit_drive", "scout2")
            await pool.clock.sleep_s(2.0)
            assert lit.granted is not None, "the lamp counts as up again as soon as it obeys"

    run_virtual(main())
