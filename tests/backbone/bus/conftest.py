"""All buses, so that what holds on one is shown to hold on the others.

The local bus runs in virtual time. The others run over a real hub on the loopback interface: the Zenoh bus with a
session for each component, without and with the lines of one host and blackboards on which large conversations leave
all values, however small; the shared bus with one session for all components (neighbors), and with two sessions that
take the components in turn (neighbors and strangers, who have lines and blackboards, too).
"""

import asyncio
import itertools
import tempfile
from collections.abc import Iterator
from pathlib import Path
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

from backbone.bus import host_boards, zenoh_outlets
from backbone.bus.clock import MissionClock, VirtualClock, VirtualLoop
from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.bus.shared_bus import SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config


@pytest.fixture
def folder() -> Iterator[Path]:
    """Return the folder of a mission's files; its path is short, as a mission's is."""
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        yield Path(name)


@pytest.fixture
def network(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the sizes of what large conversations put to the network."""
    sizes: list[int] = []

    class Counted:
        def __init__(self, publisher: Any) -> None:
            self._of = publisher

        def __getattr__(self, name: str) -> Any:
            return getattr(self._of, name)

        def put(self, raw: bytes) -> None:
            sizes.append(len(raw))
            self._of.put(raw)

    class Outlet(zenoh_outlets.Outlet):
        def __init__(self, key: str, publisher: Any, *others: Any) -> None:
            super().__init__(key, Counted(publisher), *others)

    monkeypatch.setattr(zenoh_outlets, "Outlet", Outlet)
    monkeypatch.setattr(zenoh_outlets, "KNOWN_AFTER_S", 0.1)
    return sizes


@pytest.fixture(params=["local", "zenoh", "one host", "shared", "shared by turns"])
def on_bus(request: pytest.FixtureRequest, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Runner:
    """Return what runs a law on one of the buses."""

    async def on_local(law: Law) -> None:
        network = LocalNetwork("conformance")
        await run_and_close(law, Net(network.join, VirtualClock()))

    monkeypatch.setattr(zenoh_outlets, "LARGE_BYTES", 0)

    async def on_zenoh(law: Law, directory: str) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        try:

            def join(source: str, own: Clock) -> Bus:
                bus = ZenohBus.open("conformance", source, own, client_config(endpoint))
                bus.use_host(directory)
                bus.boards = host_boards.boards_for(directory)
                return bus

            await run_and_close(law, Net(join, clock))
        finally:
            await hub.close()

    async def on_shared(law: Law, processes: int, directory: str) -> None:
        endpoint = free_endpoint()
        clock = MissionClock.started_now()
        hub = ZenohBus.open("conformance", "backbone/hub", clock, hub_config([endpoint]))
        sessions = [SharedSession("conformance", endpoint, "", directory) for _ in range(processes)]
        turns = itertools.cycle(sessions)
        try:
            await run_and_close(law, Net(lambda source, own: next(turns).join(source, own), clock))
        finally:
            for session in sessions:
                await session.close()
            await hub.close()

    runs: dict[str, Any] = {
        "local": on_local,
        "zenoh": lambda law: on_zenoh(law, ""),
        "one host": lambda law: on_zenoh(law, str(folder)),
        "shared": lambda law: on_shared(law, 1, ""),
        "shared by turns": lambda law: on_shared(law, 2, str(folder)),
    }

    def run(law: Law) -> None:
        local = request.param == "local"
        with asyncio.Runner(loop_factory=VirtualLoop if local else uvloop.new_event_loop) as runner:
            runner.run(runs[request.param](law))

    return run
