"""The nameserver as the hub of real processes: deaths, and its own restart."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec
import pytest
from free_ports import free_endpoint

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import LifeState, NameTaken
from backbone.component.process import EXIT_REFUSED
from backbone.keys import Conversation
from backbone.nameserver.messages import RECONNECT_S, Appeared, Components, Disappeared, ListComponents
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem

pytestmark = pytest.mark.processes

COMPONENTS = """
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component, NoParameters


class Quick(Component[NoParameters]):
    pass


class Slow(Component[NoParameters]):
    async def connect(self) -> None:
        await self.clock.sleep_s(60.0)
"""
BECOME = """
import sys, msgspec
from backbone.component.launch import Launch
from backbone.component.process import run_process
sys.exit(run_process(msgspec.msgpack.decode(bytes.fromhex(sys.argv[1]), type=Launch)))
"""
WITHIN_S = 15.0  # chosen: an interpreter that imports everything on a machine with other work


class Probe(Component[NoParameters]):
    """A component beside the nameserver in the test's own process, with a session of its own."""


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


def launch(endpoint: str, name: str, subsystem: Subsystem, class_path: str, run_directory: Path) -> Launch:
    origin_s = time.monotonic()
    return Launch(
        "core", subsystem, name, name, class_path, "a", endpoint, origin_s, 1.0, run_directory=str(run_directory)
    )


def begin(kind: type[Component[NoParameters]], order: Launch) -> Component[NoParameters]:
    clock = MissionClock(order.clock_origin_monotonic_s)
    return kind(order, kind.open_bus(order, clock), clock)


@asynccontextmanager
async def live(kind: type[Component[NoParameters]], order: Launch) -> AsyncIterator[Component[NoParameters]]:
    """Let it live in this process over Zenoh."""
    component = begin(kind, order)
    life = asyncio.create_task(component.run(), name=f"life of {order.name}")
    try:
        yield component
    finally:
        component.end("the test is over")
        await life


@asynccontextmanager
async def asker(endpoint: str) -> AsyncIterator[Bus]:
    bus = ZenohBus.open("core", "ui_console/asker", MissionClock.started_now(), client_config(endpoint))
    try:
        yield bus
    finally:
        await bus.close()


async def listing(bus: Bus) -> Components:
    clock = MissionClock.started_now()
    return await ask_until_answered(bus, clock, NAMESERVER, ListComponents(), Components, each_s=2.0, within_s=WITHIN_S)


async def until(bus: Bus, holds: Callable[[Components], bool], what: str) -> Components:
    """Return the first list of which this holds."""
    clock = MissionClock.started_now()
    while clock.now_s() < WITHIN_S:
        listed = await listing(bus)
        if holds(listed):
            return listed
        await clock.sleep_s(0.02)
    raise AssertionError(f"not within {WITHIN_S} s: {what}; {listed}")


def states(listed: Components) -> dict[str, LifeState]:
    return {state.address.rpartition("/")[2]: state.state for state in listed.components}


@asynccontextmanager
async def process(order: Launch, folder: Path) -> AsyncIterator[subprocess.Popen[bytes]]:
    """Run the component in a process of its own, which is gone afterwards."""
    (folder / "probes.py").write_text(COMPONENTS)
    raw = msgspec.msgpack.encode(order).hex()
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", BECOME, raw]
    child = await asyncio.to_thread(subprocess.Popen, command, env={**os.environ, "PYTHONPATH": path})
    try:
        yield child
    finally:
        child.kill()
        await asyncio.to_thread(child.wait)


async def test_a_hub_restarted_on_its_port_finds_everybody_again(endpoint: str, tmp_path: Path) -> None:
    hub = launch(endpoint, "nameserver", Subsystem.BACKBONE, "", tmp_path / "run")
    scouts = [launch(endpoint, name, Subsystem.RESOURCE_POOL, "", tmp_path) for name in ("scout1", "scout2")]
    everybody = {"nameserver", "scout1", "scout2"}
    async with (
        asyncio.timeout(3 * WITHIN_S),
        live(Nameserver, hub) as first,
        live(Probe, scouts[0]),
        live(Probe, scouts[1]),
        asker(endpoint) as bus,
    ):
        ready = dict.fromkeys(everybody, LifeState.READY)
        before = await until(bus, lambda listed: states(listed) == ready, "all ready")
        assert before.complete
        await first.leave_bus()
        first.end("killed")
        gone_s = time.monotonic()
        async with live(Nameserver, hub):
            after = await until(bus, lambda listed: set(states(listed)) == everybody, "registered again")
            assert time.monotonic() - gone_s < 2 * RECONNECT_S
            assert after.hub_since_s > before.hub_since_s
            with pytest.raises(NameTaken):
                await begin(Probe, scouts[0]).run()
            settled = await until(bus, lambda listed: listed.complete, "complete")
            assert states(settled) == ready


async def test_a_killed_process_is_missed_within_a_moment_ready_or_not(endpoint: str, tmp_path: Path) -> None:
    hub = launch(endpoint, "nameserver", Subsystem.BACKBONE, "", tmp_path / "run")
    quick = launch(endpoint, "quick", Subsystem.RESOURCE_POOL, "probes:Quick", tmp_path)
    slow = launch(endpoint, "slow", Subsystem.RESOURCE_POOL, "probes:Slow", tmp_path)
    gone: list[str] = []
    async with asyncio.timeout(3 * WITHIN_S), live(Nameserver, hub), asker(endpoint) as bus:
        bus.subscribe(
            NAMESERVER,
            Conversation.EVENTS,
            Appeared | Disappeared,
            lambda heard: gone.append(heard.body.address) if isinstance(heard.body, Disappeared) else None,
        )
        async with process(quick, tmp_path) as ready, process(slow, tmp_path) as connecting:
            wanted = {"nameserver": LifeState.READY, "quick": LifeState.READY, "slow": LifeState.CONNECTING}
            listed = await until(bus, lambda listed: states(listed) == wanted, "one ready, one connecting")
            assert {state.pid for state in listed.components} == {os.getpid(), ready.pid, connecting.pid}
            async with process(slow, tmp_path) as second:
                assert await asyncio.to_thread(second.wait, WITHIN_S) == EXIT_REFUSED
            killed_s = time.monotonic()
            for child in (ready, connecting):
                child.send_signal(signal.SIGKILL)
            await until(bus, lambda listed: set(states(listed)) == {"nameserver"}, "both missed")
            assert time.monotonic() - killed_s < 1.0
            assert gone == ["resource_pool/quick"]
