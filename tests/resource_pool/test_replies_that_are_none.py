"""A radio's driver that takes something else for a reply ends its RC, and is not lost in a callback."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from pool_on_local_network import WiretappedRadio, a_pool
from pool_orders import command, connect_robot

from backbone.bus.clock import run_virtual
from resource_pool.commands import Drive
from resource_pool.drivers.interface import HardwareFault

WRONG = {"text": "ready", "a number": 5, "None": None, "an array": np.ones(3), "too long": bytes(4097)}


class HearingRadio(WiretappedRadio):
    """Says what the test says."""

    says: ClassVar[Callable[[Any], None]]

    def hear(self, network_id: int, heard: Callable[[bytes], None]) -> None:
        HearingRadio.says = staticmethod(heard)


@pytest.mark.parametrize("kind", WRONG)
def test_what_is_no_reply_ends_the_radio(local_mission: Any, kind: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            await pool.rc("radio", driver=f"{__name__}:HearingRadio")
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(1.0, 1.0))
            HearingRadio.says(b"")
            HearingRadio.says(memoryview(b"good"))
            await pool.clock.sleep_s(0.1)
            assert pool.is_alive("radio")
            HearingRadio.says(WRONG[kind])
            await pool.clock.sleep_s(0.5)
            assert not pool.is_alive("radio")
            bug = await pool.outcome("radio")
            assert isinstance(bug, HardwareFault)
            assert "no reply of a robot" in str(bug)

    run_virtual(main())
