"""One component in a process of its own: signals, exit codes, and what others hear of its end."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
from free_ports import free_endpoint
from plain_component import Stumble

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.component.class_path import WrongClassPath, load_class
from backbone.component.launch import Launch
from backbone.component.messages import AskState, ComponentState, LifeState, Stop, Stopping
from backbone.component.process import EXIT_BUG, EXIT_NO_HUB, EXIT_REFUSED
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.naming import Subsystem

pytestmark = pytest.mark.processes

DEADLINE_S = 20.0
PLAIN = "resource_pool/plain"
BECOME = """
import sys, msgspec
from backbone.bus import zenoh_settings
from backbone.component.launch import Launch
from backbone.component.process import run_process
zenoh_settings.OPEN_TIMEOUT_MS = 2000
sys.exit(run_process(msgspec.msgpack.decode(bytes.fromhex(sys.argv[1]), type=Launch)))
"""


class Watched:
    """A process, and what others hear of the component in it."""

    def __init__(self, process: asyncio.subprocess.Process, hub: ZenohBus) -> None:
        self.process, self.hub = process, hub
        self.states: list[ComponentState] = []
        self.ready, self.fallen = asyncio.Event(), asyncio.Event()

    def heard(self, state: ComponentState) -> None:
        self.states.append(state)

    def changed(self, _address: str, alive: bool) -> None:
        (self.ready if alive else self.fallen).set()

    async def exit_code(self) -> int:
        return await within(self.process.wait(), "the process ends")


async def within(work: Any, what: str) -> Any:
    try:
        async with asyncio.timeout(DEADLINE_S):
            return await work
    except TimeoutError:
        pytest.fail(f"not within {DEADLINE_S:g} s: {what}")


@asynccontextmanager
async def process_of(*, hub_is_up: bool = True, **changed: Any) -> AsyncIterator[Watched]:
    endpoint = free_endpoint()
    clock = MissionClock.started_now()
    listening = endpoint if hub_is_up else "tcp/127.0.0.1:0"
    hub = ZenohBus.open("process", "backbone/hub", clock, hub_config([listening]))
    launch = Launch(
        "process",
        Subsystem.RESOURCE_POOL,
        "plain",
        "plain",
        "plain_component:Plain",
        "here",
        endpoint,
        clock.origin_monotonic_s,
        clock.rate,
    )
    launch = msgspec.structs.replace(launch, **changed)
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-c",
        BECOME,
        msgspec.msgpack.encode(launch).hex(),
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent), "SCOUT_LOG": "CRITICAL"},
        stderr=asyncio.subprocess.DEVNULL,
    )
    watched = Watched(process, hub)
    hub.subscribe(PLAIN, Conversation.STATUS, ComponentState, lambda e: watched.heard(e.body))
    hub.watch_alive(PLAIN, watched.changed)
    try:
        yield watched
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
        await hub.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
async def test_a_signal_ends_it_in_good_order(number: signal.Signals) -> None:
    async with process_of() as watched:
        await within(watched.ready.wait(), "it is ready")
        watched.process.send_signal(number)
        assert await watched.exit_code() == 0
        await within(watched.fallen.wait(), "its token falls")
        states = [(state.state, state.feedback) for state in watched.states]
        assert states[-2:] == [(LifeState.DRAINING, ""), (LifeState.STOPPED, "drained")]


async def test_stop_ends_it_in_good_order() -> None:
    async with process_of() as watched:
        await within(watched.ready.wait(), "it is ready")
        state = await watched.hub.ask(PLAIN, AskState(), ComponentState, within_s=DEADLINE_S)
        assert state.pid == watched.process.pid
        assert await watched.hub.ask(PLAIN, Stop("enough"), Stopping, within_s=DEADLINE_S) == Stopping()
        assert await watched.exit_code() == 0


async def test_a_bug_ends_the_process_with_its_own_code_and_is_told() -> None:
    async with process_of() as watched:
        await within(watched.ready.wait(), "it is ready")
        with pytest.raises(NoResponder):
            await watched.hub.ask(PLAIN, Stumble(), Stopping, within_s=DEADLINE_S)
        assert await watched.exit_code() == EXIT_BUG
        await within(watched.fallen.wait(), "its token falls")
        assert (watched.states[-1].state, watched.states[-1].feedback) == (LifeState.FAILED, "KeyError: 'stumbled'")


async def test_a_bug_at_once_ends_the_process_too() -> None:
    async with process_of(parameters={"stumble": "serve"}) as watched:
        assert await watched.exit_code() == EXIT_BUG


@pytest.mark.parametrize(
    "changed",
    [
        {"parameters": {"speed": 1}},
        {"class_path": "plain_component:Nobody"},
        {"class_path": "no_such_module:Plain"},
        {"class_path": "plain_component:Where"},
    ],
)
async def test_what_cannot_begin_is_refused_by_exit_code(changed: dict[str, Any]) -> None:
    async with process_of(**changed) as watched:
        assert await watched.exit_code() == EXIT_REFUSED
        assert not watched.ready.is_set()


async def test_without_a_hub_it_ends_with_its_own_code() -> None:
    async with process_of(hub_is_up=False) as watched:
        assert await watched.exit_code() == EXIT_NO_HUB


async def test_a_killed_process_is_seen_by_its_token_alone() -> None:
    async with process_of() as watched:
        await within(watched.ready.wait(), "it is ready")
        watched.process.kill()
        await within(watched.fallen.wait(), "its token falls")
        assert [state.state for state in watched.states] in ([], [LifeState.READY])


@pytest.mark.parametrize(
    "path", ["", ":", "backbone", "backbone:", "backbone.errors:Refusal", "no.such:Thing", "a b:C"]
)
def test_a_class_path_that_leads_to_no_component_is_refused(path: str) -> None:
    with pytest.raises(WrongClassPath):
        load_class(path)
