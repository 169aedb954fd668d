"""Pictures of 320 x 240 grey levels (76.8 kB), 30 a second, from one process to 1, 4 and 16 listeners of its host.

The bus sends them to its listeners by a blackboard. Beside it, in the same run and in turns of a second: bare
zenoh-python with shared memory, through the same hub, with as many bytes and the same bridge into asyncio. Both drop
pictures if a queue is full. Prints one JSON line for each number of listeners: latency of all listeners' pictures, and
the processor time of sender, hub and listeners together for one picture, without their idle use.
``ratio`` is bus p50 over bare p50, ``processor_ratio`` the same of processor times; ``ros1`` has both of ROS 1.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import uvloop
import zenoh
from bare_hub import bare_hub
from measuring import helper, line_of, percentile, report, summary, wait_for_end_of_input

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.bus.zenoh_settings import client_settings, hub_settings
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from resource_pool.messages import Frame

MISSION, CLOCK = "bench", MissionClock(0.0)
GRABBER = address(Subsystem.RESOURCE_POOL, "framegrabber")
BARE_KEY = "bare/frames"
WIDTH_PX, HEIGHT_PX, RATE_HZ = 320, 240, 30.0
TURN_S, REST_S = 1.0, 0.1  # chosen: a turn of each way, and a rest longer than any picture of the other way takes
WARM_UP = 10_000_000  # first number of the pictures that are not counted
ROS1_US = {1: (562, 660), 4: (828, 777), 16: (1882, 1606)}
"""Listeners → p50 of ROS 1, and of bare zenoh with shared memory beside it, for the same pictures.

Source: measured for issue 16 in one run, before this program existed; on another machine, so use only the ratio.
"""
ROS1_PROCESSOR_MS = {1: (0.89, 1.56), 4: (2.24, 2.51), 16: (6.79, 6.43)}
"""The same of processor time for a picture; same source."""


def with_shared_memory(settings: dict[str, Any]) -> zenoh.Config:
    """Return a configuration like the bus's, with shared memory."""
    settings["transport"] = {**settings["transport"], "shared_memory": {"enabled": True}}
    return zenoh.Config.from_json5(json.dumps(settings))


def joined(folder: str, source: str) -> tuple[ZenohBus, zenoh.Session]:
    """Return a component's bus, and a bare session beside it."""
    endpoint = socket_endpoint(Path(folder))
    bus = ZenohBus.open(MISSION, source, CLOCK, client_config(endpoint))
    bus.boards = boards_for(folder)
    return bus, zenoh.open(with_shared_memory(client_settings(endpoint)))


def be_hub(folder: str) -> None:
    """Run as the hub process."""
    with bare_hub(with_shared_memory(hub_settings([socket_endpoint(Path(folder))], ""))):
        print("ready", flush=True)
        wait_for_end_of_input()


def processor_s(pids: Sequence[int]) -> float:
    """Return the processor time that these processes have used, all threads; Linux, ``clock_getcpuclockid``."""
    return sum(time.clock_gettime((~pid << 3) | 2) for pid in pids)


async def publish(folder: str, frames: int, pids: list[int]) -> None:
    """Run as the publishing process, in turns of both ways; print the processor time of each for a picture."""
    bus, bare = joined(folder, GRABBER)
    publisher = bare.declare_publisher(
        BARE_KEY, priority=zenoh.Priority.DATA_LOW, congestion_control=zenoh.CongestionControl.DROP
    )
    picture = np.arange(WIDTH_PX * HEIGHT_PX, dtype=np.uint32).astype(np.uint8)
    as_bytes, pixels, here = picture.tobytes(), memoryview(picture), [os.getpid(), *pids]

    def on_bus(number: int) -> None:
        made = Frame("framegrabber", "watch", 1, "scout1", number, time.monotonic(), WIDTH_PX, HEIGHT_PX, pixels)
        bus.publish(GRABBER, Conversation.FRAMES, made)

    def on_bare(number: int) -> None:
        publisher.put(struct.pack(">id", number, time.monotonic()) + as_bytes)

    a_turn = int(TURN_S * RATE_HZ)
    turns = [range(WARM_UP, WARM_UP + a_turn)] + [range(n, min(n + a_turn, frames)) for n in range(0, frames, a_turn)]
    began_s = processor_s(here)
    await CLOCK.sleep_s(TURN_S)
    idle = (processor_s(here) - began_s) / TURN_S
    spent = {"bus": 0.0, "bare": 0.0}
    for turn in turns:
        for name, say in (("bus", on_bus), ("bare", on_bare)):
            began_s, turn_began_s = processor_s(here), time.monotonic()
            for number in turn:
                say(number)
                await CLOCK.sleep_s(1 / RATE_HZ)
            await CLOCK.sleep_s(REST_S)
            if turn.start < WARM_UP:
                spent[name] += processor_s(here) - began_s - idle * (time.monotonic() - turn_began_s)
    print(json.dumps({name: round(spent_s / frames * 1e6) for name, spent_s in spent.items()}), flush=True)
    await asyncio.get_running_loop().run_in_executor(None, wait_for_end_of_input)
    await bus.close()
    bare.close()


async def listen(folder: str, name: str) -> None:
    """Run as a listener; print the latencies of both ways at the end of input."""
    bus, bare = joined(folder, address(Subsystem.MISSION_CONTROL, name))
    loop, latencies_s = asyncio.get_running_loop(), {"bus": list[float](), "bare": list[float]()}

    def note(way: str, number: int, captured_s: float) -> None:
        if number < WARM_UP:
            latencies_s[way].append(time.monotonic() - captured_s)

    def bare_in_loop(sample: zenoh.Sample) -> None:
        raw = sample.payload.to_bytes()
        note("bare", *struct.unpack_from(">id", raw))

    bare.declare_subscriber(BARE_KEY, lambda sample: loop.call_soon_threadsafe(bare_in_loop, sample))
    bus.subscribe(
        GRABBER,
        Conversation.FRAMES,
        Frame,
        lambda one: note("bus", one.body.number, one.body.captured_s),
        latest=True,
    )
    await asyncio.sleep(0.2)  # of the machine: both subscriptions are known to the hub
    print("ready", flush=True)
    await loop.run_in_executor(None, wait_for_end_of_input)
    print(json.dumps(latencies_s), flush=True)
    await bus.close()
    bare.close()


def ratios(listeners: int, p50_s: Mapping[str, float], processor_us: Mapping[str, float]) -> dict[str, object]:
    """Return the ratio of the bus to bare zenoh, and that of ROS 1 to bare zenoh, if it was measured."""
    ratio, processor_ratio = p50_s["bus"] / p50_s["bare"], processor_us["bus"] / max(1.0, processor_us["bare"])
    told: dict[str, object] = {"ratio": round(ratio, 3), "processor_ratio": round(processor_ratio, 3)}
    if listeners in ROS1_US:
        (ros1, bare), (ros1_ms, bare_ms) = ROS1_US[listeners], ROS1_PROCESSOR_MS[listeners]
        told["ros1"] = {"ratio": round(ros1 / bare, 2), "processor_ratio": round(ros1_ms / bare_ms, 2)}
        told["below_ros1"] = {"ratio": ratio < ros1 / bare, "processor_ratio": processor_ratio < ros1_ms / bare_ms}
    return told


def measure(listeners: int, frames: int) -> None:
    """Run a hub, so many listeners and a publisher, and report."""
    with tempfile.TemporaryDirectory(prefix="s-") as folder, ExitStack() as running:

        def begin(*arguments: object) -> subprocess.Popen[bytes]:
            return running.enter_context(helper(__file__, *map(str, arguments), answers=True))

        hub = begin("hub", folder)
        assert line_of(hub) == "ready"
        crowd = [begin("listener", folder, f"listener-{number}") for number in range(listeners)]
        assert all(line_of(one) == "ready" for one in crowd)
        publisher = begin("publisher", folder, frames, *(one.pid for one in (hub, *crowd)))
        processor_us = json.loads(line_of(publisher))
        heard: list[dict[str, list[float]]] = []
        for one in crowd:
            assert one.stdin is not None
            one.stdin.close()
            heard.append(json.loads(line_of(one)))
    both = {way: [latency for one in heard for latency in one[way]] for way in ("bus", "bare")}
    report(
        "frames",
        listeners=listeners,
        frames=frames,
        bytes=WIDTH_PX * HEIGHT_PX,
        rate_hz=RATE_HZ,
        **{
            way: {**summary(all_s), "arrived": round(len(all_s) / listeners / frames, 3)} for way, all_s in both.items()
        },
        processor_us=processor_us,
        **ratios(listeners, {way: percentile(all_s, 0.5) for way, all_s in both.items()}, processor_us),
    )


def main() -> None:
    """Run the role named first, or all of them."""
    match sys.argv[1:]:
        case ["hub", folder]:
            be_hub(folder)
        case ["listener", folder, name]:
            uvloop.run(listen(folder, name))
        case ["publisher", folder, frames, *pids]:
            uvloop.run(publish(folder, int(frames), [int(pid) for pid in pids]))
        case _:
            parser = argparse.ArgumentParser(description=__doc__)
            parser.add_argument("listeners", nargs="*", type=int, default=[1, 4, 16])
            parser.add_argument("--frames", type=int, default=150, help="at 30 a second, each way")
            chosen = parser.parse_args()
            for count in chosen.listeners:
                measure(count, chosen.frames)


if __name__ == "__main__":
    main()
