"""The hub hangs, dies and returns: a unit with all that it needs in itself keeps its rate, and joins again."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import msgspec
import psutil
import pytest
from lonely_unit import Much, Reading

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, ComponentState, Statistics
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.naming import Subsystem
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.orders import ModuleOrder

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.alone, pytest.mark.timeout(120)]

HERE = Path(__file__).parent
ROBOT, MISSION, WITHIN_S = "mission_control/robot", "units", 20.0
RATE_HZ, LEAST_SHARE = 50.0, 0.7  # a machine with other work
LONGEST_GAP_S = 0.8  # a hub that hangs would block for 1 s
AWAY_S = 5.0  # longer than a session lasts without a sign of the other
MOST_GROWTH_BYTES = 8_000_000
BECOME = """
import sys, msgspec
from backbone.component.launch import Launch
from backbone.component.process import run_process
sys.exit(run_process(msgspec.msgpack.decode(bytes.fromhex(sys.argv[1]), type=Launch)))
"""


@contextmanager
def hub(endpoint: str) -> Iterator[subprocess.Popen[str]]:
    """Give a hub in a process of its own, when it listens."""
    words = [sys.executable, str(HERE / "bus_roles.py"), "hub", endpoint, "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "ready"
            yield process
        finally:
            process.kill()


@dataclass
class Robot:
    """The process of the unit, and the file in which its actuator writes."""

    process: psutil.Process
    file: Path

    def check(self, what: str, since_s: float) -> None:
        """Check that it kept its rate from then until now."""
        now_s = time.monotonic()
        acted_s = [at_s for at_s in map(float, self.file.read_text().splitlines()) if at_s >= since_s]
        share = len(acted_s) / (RATE_HZ * (now_s - since_s))
        longest_s = max(later - earlier for earlier, later in pairwise([since_s, *acted_s, now_s]))
        print(f"{what}: {share:.3f} of its rounds, longest gap {longest_s:.3f} s")
        assert share > LEAST_SHARE, what
        assert longest_s < LONGEST_GAP_S, what


@contextmanager
def robot(endpoint: str, folder: Path, kind: str) -> Iterator[Robot]:
    """Give the unit, in a process of its own."""
    file = folder / "acted"
    order = UnitOrder(
        name="robot",
        frequency_hz=RATE_HZ,
        own_thread=kind == "UnitBesideTalk",
        modules=[
            ModuleOrder("sensor", "lonely_unit:Sensor"),
            ModuleOrder("actuator", "lonely_unit:Actuator", {"path": str(file)}),
            *([ModuleOrder("camera", "lonely_unit:Camera")] if kind == "UnitOfPictures" else []),
        ],
    )
    launch = Launch(
        MISSION,
        Subsystem.MISSION_CONTROL,
        "robot",
        "execution_unit",
        f"lonely_unit:{kind}",
        "here",
        endpoint,
        MissionClock.started_now().origin_monotonic_s,
        1.0,
        msgspec.to_builtins(arranged([order], {})["robot"]),
    )
    words = [sys.executable, "-c", BECOME, msgspec.msgpack.encode(launch).hex()]
    with subprocess.Popen(words, env={**os.environ, "PYTHONPATH": str(HERE), "SCOUT_LOG": "CRITICAL"}) as process:
        try:
            yield Robot(psutil.Process(process.pid), file)
            process.terminate()
            assert process.wait(WITHIN_S) == 0
        finally:
            process.kill()


async def is_there(endpoint: str) -> None:
    """Return when the unit is heard at the hub, and answers."""
    bus = await ZenohBus.open_when_up(MISSION, "ui_console/tester", MissionClock.started_now(), client_config(endpoint))
    try:
        async with asyncio.timeout(WITHIN_S):
            alive, heard = asyncio.Event(), asyncio.Event()
            bus.watch_alive(ROBOT, lambda _address, stands: alive.set() if stands else None)
            bus.subscribe(f"{ROBOT}/done", Conversation.OUTPUTS, Reading, lambda _one: heard.set())
            await alive.wait()
            await heard.wait()
            told = None
            while told is None:
                with suppress(NoResponder):  # the hub has just forgotten the session before this one
                    told = await bus.ask(ROBOT, AskStatistics(), Statistics, within_s=WITHIN_S)
            assert told.values.get("thread_lost", 0.0) == 0.0
    finally:
        await bus.close()


@contextmanager
def crowd(endpoint: str) -> Iterator[None]:
    """Listen to all that is sent, in a process that outlives the hub."""
    words = [sys.executable, __file__, endpoint]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "ready"
            yield
        finally:
            process.kill()


@pytest.mark.parametrize("kind", ["QuietUnit", "UnitBesideTalk", "UnitOfPictures"])
def test_a_unit_goes_on_while_its_hub_hangs_and_when_it_is_dead_and_joins_again(kind: str, short_path: Path) -> None:
    endpoint = socket_endpoint(short_path)
    with hub(endpoint) as first, crowd(endpoint), robot(endpoint, short_path, kind) as one:
        asyncio.run(is_there(endpoint))
        began_bytes, began_s = one.process.memory_info().rss, time.monotonic()
        os.kill(first.pid, signal.SIGSTOP)
        time.sleep(AWAY_S)
        one.check("the hub hangs", began_s)
        os.kill(first.pid, signal.SIGCONT)
        asyncio.run(is_there(endpoint))
        began_s = time.monotonic()
        first.kill()
        time.sleep(AWAY_S)
        one.check("the hub is dead", began_s)
        with hub(endpoint):
            asyncio.run(is_there(endpoint))
            grown = one.process.memory_info().rss - began_bytes
            print(f"grown by {grown} bytes")
            assert grown < MOST_GROWTH_BYTES


async def listen(endpoint: str) -> None:
    bus = await ZenohBus.open_when_up(MISSION, "ui_console/crowd", MissionClock.started_now(), client_config(endpoint))
    bus.subscribe(f"{ROBOT}/done", Conversation.OUTPUTS, Reading, lambda _one: None)
    bus.subscribe(f"{ROBOT}/picture", Conversation.OUTPUTS, Much, lambda _one: None)
    bus.subscribe(ROBOT, Conversation.EVENTS, Much, lambda _one: None)
    bus.subscribe(ROBOT, Conversation.STATUS, ComponentState, lambda _one: None)
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(listen(sys.argv[1]))
