"""An ARC that rests holds nothing and is asked for again without a new one."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any

import pytest
from pool_on_local_network import a_pool

from backbone.bus.clock import run_virtual
from backbone.errors import Refusal
from resource_pool.messages import SwappedOut

ROBOTS = ["scout1", "scout2", "radio"]


def test_what_rests_holds_nothing_and_lets_others_have_it_until_it_is_woken(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            watcher = await pool.owner("watcher")
            patrol = await pool.arc(watcher, "drive", "scout1")
            await patrol.wait_granted()
            person, arc = await pool.console("person", "drive", "scout1")
            first = await arc.wait_granted()
            running = pool.running[arc.arc]
            for turn in (1, 2, 3):
                await arc.drive(2.0, 2.0)
                await arc.rest()
                assert arc.granted is None
                with pytest.raises(SwappedOut):
                    await arc.drive(2.0, 2.0)
                assert (await asyncio.wait_for(patrol.wait_granted(), 5.0)).rcs["scout"] == "scout1"
                keeping = asyncio.create_task(arc.keep(pool.clock, "drive", {}, rests=True))
                again = await asyncio.wait_for(arc.wait_granted(), 5.0)
                assert again.epochs["scout1"] > first.epochs["scout1"]
                assert pool.running[arc.arc] is running
                assert person.heard() == ["Resumed", "Suspended"] * turn + ["Resumed"]
                keeping.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await keeping
            assert pool.audit["stale_packets"] == 0

    run_virtual(main())


def test_what_cannot_be_told_to_rest_says_so(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ROBOTS) as pool:
            _person, arc = await pool.console("person", "drive", "scout1")
            await arc.wait_granted()
            await pool.kill("rc_manager")
            with pytest.raises(Refusal, match="no answer"):
                await arc.rest()

    run_virtual(main())
