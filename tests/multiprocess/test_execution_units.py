"""Two execution units in processes of their own: what one produces, the other takes."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import msgspec
import pytest
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, Statistics
from backbone.keys import Conversation
from backbone.naming import Subsystem
from mission_control.modules.arrangement import GivenKey, UnitOrder, arranged
from mission_control.modules.orders import ModuleOrder, Source, UnitParameters

pytestmark = pytest.mark.processes

WITHIN_S = 30.0
HUB = "backbone/hub"
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
BECOME = """
import sys, msgspec
from backbone.component.launch import Launch
from backbone.component.process import run_process
sys.exit(run_process(msgspec.msgpack.decode(bytes.fromhex(sys.argv[1]), type=Launch)))
"""


@asynccontextmanager
async def process_of(name: str, parameters: UnitParameters, hub: ZenohBus, endpoint: str) -> AsyncIterator[None]:
    """Let the unit live in a process of its own, from its readiness to the end of the block."""
    given, clock = msgspec.to_builtins(parameters), MissionClock.started_now()
    order = Launch(
        "units",
        Subsystem.MISSION_CONTROL,
        name,
        "execution_unit",
        "free_unit:FreeUnit",
        "here",
        endpoint,
        clock.origin_monotonic_s,
        1.0,
        given,
    )
    path = os.pathsep.join([str(Path(__file__).parent), str(EXAMPLES)])
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-c",
        BECOME,
        msgspec.msgpack.encode(order).hex(),
        env={**os.environ, "PYTHONPATH": path, "SCOUT_LOG": "CRITICAL"},
    )
    ready = asyncio.Event()
    hub.watch_alive(order.address, lambda _address, alive: ready.set() if alive else None)
    try:
        async with asyncio.timeout(WITHIN_S):
            await ready.wait()
        yield
    finally:
        process.kill()
        await process.wait()


async def test_two_units_in_two_processes_say_what_the_modules_say_by_hand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(EXAMPLES)
    import pair

    second = ModuleOrder("second", "pair:Smoothing", {"weight": 0.5}, {"wave": "smooth"}, {"smooth": "smoother"})
    units = arranged(
        [
            UnitOrder(name="early", modules=[ModuleOrder("first", "pair:Smoothing")]),
            UnitOrder(name="late", modules=[second]),
        ],
        {"wave": GivenKey("pair:Height", Source(HUB, Conversation.EVENTS))},
    )
    endpoint = free_endpoint()
    hub = ZenohBus.open("units", HUB, MissionClock.started_now(), hub_config([endpoint]))
    heard: asyncio.Queue[pair.Height] = asyncio.Queue()
    said: list[pair.Height] = []
    waves = [pair.Height(float(number * number % 7)) for number in range(50)]
    async with AsyncExitStack() as stack:
        stack.push_async_callback(hub.close)
        hub.subscribe(
            "mission_control/late/smoother", Conversation.OUTPUTS, pair.Height, lambda one: heard.put_nowait(one.body)
        )
        for name in ("late", "early"):  # who takes is there before who produces
            await stack.enter_async_context(process_of(name, units[name], hub, endpoint))
        for wave in waves:
            hub.publish(HUB, Conversation.EVENTS, wave)
            async with asyncio.timeout(WITHIN_S):
                said.append(await heard.get())
        told = (await hub.ask("mission_control/early", AskStatistics(), Statistics, within_s=WITHIN_S)).values
        assert told["rounds"] == told["first_runs"] == len(waves)
    first, then = pair.Smoothing(), pair.Smoothing(pair.Smoothing.Parameters(weight=0.5))
    expected = [then.update(then.Inputs(first.update(first.Inputs(wave)).smooth)).smooth for wave in waves]
    assert msgspec.msgpack.encode(said) == msgspec.msgpack.encode(expected)
