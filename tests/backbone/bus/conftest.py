"""All buses, so that what holds on one is shown to hold on the others.

The local bus runs in virtual time. The others run over a real hub on the loopback interface: the Zenoh bus with a
session for each component; the shared bus with one session for all components (neighbors), and with two sessions that
take the components in turn (neighbors and strangers).
"""

import asyncio
import itertools
from typing import Any

import pytest
import uvloop
from bus_laws import (
    Law,
    Net,
    Runner,
    run_and_close,
)
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock, VirtualClock, VirtualLoop
from backbone.bus.local_bus import LocalNetwork
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config


@pytest.fixture(params=["local", "zenoh", "shared", "shared by turns"])
def on_bus(request: pytest.FixtureRequest) -> Runner:
    """Return what runs a law on one of the buses."""

    async def on_local(law: Law) -> None:
        network = LocalNetwork("conformance")
        await run_and_close(law, Net(network.join, VirtualClock()))

    async def on_zenoh(law: Law) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        try:
            net = Net(lambda source, own: ZenohBus.open("conformance", source, own, client_config(endpoint)), clock)
            await run_and_close(law, net)
        finally:
            await hub.close()

    async def on_shared(law: Law, processes: int) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        sessions = [SharedSession("conformance", endpoint) for _ in range(processes)]
        turns = itertools.cycle(sessions)
        try:
            await run_and_close(law, Net(lambda source, own: next(turns).join(source, own), clock))
        finally:
            for session in sessions:
                await session.close()
            await hub.close()

    runs: dict[str, Any] = {
        "local": on_local,
        "zenoh": on_zenoh,
        "shared": lambda law: on_shared(law, 1),
        "shared by turns": lambda law: on_shared(law, 2),
    }

    def run(law: Law) -> None:
        local = request.param == "local"
        with asyncio.Runner(loop_factory=VirtualLoop if local else uvloop.new_event_loop) as runner:
            runner.run(runs[request.param](law))

    return run
