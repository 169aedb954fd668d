"""A robot whose RC needs time to obey, as to read a sensor, does not move after a stop that came meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.rc_manager.messages import Connect, Connected
from backbone.scheduling.requests import RcUse, Usage
from resource_pool.arc_client import EmergencyStopped, lift_stop, stop_robot
from resource_pool.commands import Command, Drive, Jump
from resource_pool.holds import Hold
from resource_pool.messages import Applied
from resource_pool.rcs.scout import Scout
from scout_model.radio_link import encode_halt

TAKES_S = 0.2


class SlowScout(Scout):
    """Thinks before it obeys."""

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        await self.clock.sleep_s(TAKES_S)
        return await super().obey(hold, order)


async def hold_both(pool: Pool) -> None:
    """Connect scout1 and the radio to an ARC whose commands the test sends."""
    streams, companions = [Usage(0.05, 0.002), Usage(0.25, 0.002, kind="jump")], {"scout1": 5, "radio": 6}
    for rc, use in (("radio", RcUse(streams)), ("scout1", RcUse())):
        order = Connect("one", companions[rc], 60.0, use, companions)
        await pool.manager_voice.ask(f"resource_pool/{rc}", order, Connected, within_s=1)


@pytest.mark.parametrize("order", [Drive(4.0, 4.0), Jump()], ids=["drive", "jump"])
@pytest.mark.parametrize("is_lifted", [False, True], ids=["stopped", "lifted again"])
def test_a_command_in_the_making_is_not_sent_after_a_stop(local_mission: Any, order: Command, is_lifted: bool) -> None:
    async def main() -> None:
        slow = {"scout": SlowScout}
        async with a_pool(local_mission, ["scout1", "radio"], manager=False, rc_classes=slow) as pool:
            await hold_both(pool)
            command = order.under("one", 5)
            obeying = asyncio.create_task(pool.voice("one").ask("resource_pool/scout1", command, Applied, within_s=1))
            await pool.clock.sleep_s(TAKES_S / 2)
            operator = pool.voice_of("ui_console/console-1")
            stop = await stop_robot(operator, "scout1", "", "anna")
            assert stop.is_confirmed
            if is_lifted:
                await lift_stop(operator, stop)
            with pytest.raises(EmergencyStopped) as refusal:
                await obeying
            assert (refusal.value.facts["rc"], refusal.value.facts["number"]) == ("scout1", stop.number)
            await pool.clock.sleep_s(1.0)
            assert {packet.payload for packet in pool.radio_driver.heard_by(1)} == {encode_halt()}

    run_virtual(main())
