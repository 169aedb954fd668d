"""A driver of simulated hardware waits for a large world, and names the world if there is none."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.wire import Envelope
from resource_pool.drivers.interface import OPENS_WITHIN_S, DriverSite, HardwareFault
from resource_pool.drivers.simulated import meet_world
from resource_pool.drivers.world_messages import AskWorld, WorldModel


async def _answer(asked: Envelope[Any]) -> WorldModel:
    return WorldModel("<mujoco/>", {})


def _site(network: LocalNetwork, clock: VirtualClock) -> DriverSite:
    own = network.join("resource_pool/grabber", clock)
    return DriverSite("grabber", own, clock, SimpleNamespace(world="world"), lambda what: None, lambda bug: None)


def test_a_world_may_take_its_time_to_compile() -> None:
    async def main() -> tuple[WorldModel, float]:
        network, clock = LocalNetwork(), VirtualClock()
        world = network.join("resource_pool/world", clock)
        asyncio.get_running_loop().call_later(40.0, world.serve, "resource_pool/world", AskWorld, _answer)
        return await meet_world(_site(network, clock)), clock.now_s()

    met, at_s = run_virtual(main())
    assert met.mjcf == "<mujoco/>"
    assert at_s >= 40.0


def test_a_world_that_is_not_there_is_named_before_the_rc_gives_up() -> None:
    async def main() -> tuple[HardwareFault, float]:
        network, clock = LocalNetwork(), VirtualClock()
        with pytest.raises(HardwareFault, match="no simulated world 'world'") as refused:
            await meet_world(_site(network, clock))
        return refused.value, clock.now_s()

    fault, at_s = run_virtual(main())
    assert "state of the world" in fault.remedy
    assert at_s < OPENS_WITHIN_S
