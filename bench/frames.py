"""Frames of 320 x 240 grey levels (76.8 kB) from one process through the hub to another.

Latency at 30 frames a second, then the most that arrives when they are published without a pause.
The floor is bare zenoh-python with as many bytes and the same bridge into asyncio; frames of both
alternate, so both see the same machine. Both publish as the bus does pictures: what finds the queue
full is dropped. Prints one JSON line; ``ratio`` is bus p50 over bare p50 of the latency.
"""

from __future__ import annotations

import argparse
import asyncio
import struct
import time
from typing import Any

import numpy as np
import uvloop
import zenoh
from measuring import free_endpoint, helper, percentile, report, summary, wait_for_end_of_input

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from resource_pool.messages import Frame

MISSION = "bench"
GRABBER, WATCHER = "resource_pool/framegrabber", "mission_control/watcher"
BARE_KEY = "bare/frames"
WIDTH_PX, HEIGHT_PX, RATE_HZ = 320, 240, 30.0
FLOOD = 1000
SETTLE_S = 1.0  # chosen: what has not arrived a second after the last frame of a flood was dropped
READY_S = 10.0


def frame(number: int, pixels: memoryview) -> Frame:
    """Return a frame that says when it was made, on the clock all processes of a machine share."""
    return Frame("framegrabber", "watch", 1, "scout1", number, time.monotonic(), WIDTH_PX, HEIGHT_PX, pixels)


async def publish(endpoint: str, frames: int) -> None:
    """Be the publishing process: paced frames, then two floods."""
    clock = MissionClock.started_now()
    bus = await ZenohBus.open_when_up(MISSION, GRABBER, clock, client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    publisher = bare.declare_publisher(
        BARE_KEY, priority=zenoh.Priority.DATA_LOW, congestion_control=zenoh.CongestionControl.DROP
    )
    picture = np.arange(WIDTH_PX * HEIGHT_PX, dtype=np.uint32).astype(np.uint8)
    as_bytes = picture.tobytes()
    ready = asyncio.Event()
    bus.watch_alive(WATCHER, lambda _address, alive: ready.set() if alive else None)
    await asyncio.wait_for(ready.wait(), READY_S)

    def on_bus(number: int) -> None:
        bus.publish(GRABBER, Conversation.FRAMES, frame(number, memoryview(picture)))

    def on_bare(number: int) -> None:
        publisher.put(struct.pack(">id", number, time.monotonic()) + as_bytes)

    cpu = {}
    for number in range(frames):
        for say in (on_bus, on_bare):
            say(number)
            await clock.sleep_s(0.5 / RATE_HZ)
    for name, say in (("bus", on_bus), ("bare", on_bare)):
        cpu_began_s = time.process_time()
        for number in range(frames, frames + FLOOD):
            say(number)
        cpu[name] = (time.process_time() - cpu_began_s) / FLOOD
        await clock.sleep_s(SETTLE_S)
    over = struct.pack(">idd", -1, cpu["bus"], cpu["bare"])
    bare.put(BARE_KEY, over, congestion_control=zenoh.CongestionControl.BLOCK)
    await asyncio.get_running_loop().run_in_executor(None, wait_for_end_of_input)
    await bus.close()
    bare.close()


def be_hub(endpoint: str) -> None:
    """Be the hub process."""
    with zenoh.open(hub_config([endpoint])):
        wait_for_end_of_input()


class Arrivals:
    """When frames arrived and how old they were."""

    def __init__(self, paced: int) -> None:
        self._paced = paced
        self.latencies_s: list[float] = []
        self.flood_s: list[float] = []

    def note(self, number: int, captured_s: float) -> None:
        """Take one frame."""
        now_s = time.monotonic()
        if number < self._paced:
            self.latencies_s.append(now_s - captured_s)
        else:
            self.flood_s.append(now_s)

    def figures(self) -> dict[str, Any]:
        """Return what was measured, for the report."""
        lasted_s = self.flood_s[-1] - self.flood_s[0]
        return {
            **summary(self.latencies_s),
            "paced_arrived": len(self.latencies_s),
            "flood_arrived_per_s": round((len(self.flood_s) - 1) / lasted_s) if lasted_s > 0 else None,
            "flood_arrived": len(self.flood_s),
        }


async def measure(endpoint: str, frames: int) -> None:
    """Be the watching process."""
    bus = await ZenohBus.open_when_up(MISSION, WATCHER, MissionClock.started_now(), client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    loop = asyncio.get_running_loop()
    over: asyncio.Future[tuple[float, float]] = loop.create_future()
    on_bus, on_bare = Arrivals(frames), Arrivals(frames)

    def bare_in_loop(sample: zenoh.Sample) -> None:
        raw = sample.payload.to_bytes()
        number = struct.unpack_from(">i", raw)[0]
        if number < 0:
            over.set_result(struct.unpack_from(">dd", raw, 4))
        else:
            on_bare.note(number, struct.unpack_from(">d", raw, 4)[0])

    bare.declare_subscriber(BARE_KEY, lambda sample: loop.call_soon_threadsafe(bare_in_loop, sample))
    bus.subscribe(GRABBER, Conversation.FRAMES, Frame, lambda e: on_bus.note(e.body.number, e.body.captured_s))
    bus.declare_alive(WATCHER)
    cpu_s = await asyncio.wait_for(over, 2 * frames / RATE_HZ + 60.0)
    report(
        "frames",
        frames=frames,
        bytes=WIDTH_PX * HEIGHT_PX,
        rate_hz=RATE_HZ,
        bus=on_bus.figures(),
        bare=on_bare.figures(),
        ratio=round(percentile(on_bus.latencies_s, 0.5) / percentile(on_bare.latencies_s, 0.5), 3),
        publish_cpu_us={"bus": round(cpu_s[0] * 1e6), "bare": round(cpu_s[1] * 1e6)},
    )
    await bus.close()
    bare.close()


def main() -> None:
    """Run the role named first, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", nargs="?", default="all", choices=["all", "hub", "publisher"])
    parser.add_argument("endpoint", nargs="?", default="")
    parser.add_argument("--frames", type=int, default=150, help="at 30 a second, each way")
    chosen = parser.parse_args()
    if chosen.role == "hub":
        be_hub(chosen.endpoint)
    elif chosen.role == "publisher":
        uvloop.run(publish(chosen.endpoint, chosen.frames))
    else:
        endpoint = free_endpoint()
        publisher = ("publisher", endpoint, "--frames", str(chosen.frames))
        with helper(__file__, "hub", endpoint), helper(__file__, *publisher):
            uvloop.run(measure(endpoint, chosen.frames))


if __name__ == "__main__":
    main()
