"""A burst of a thousand pictures of 320 x 240: how many arrive, and when the last one does.

Three kinds of listeners, each in a process of its own, take turns: lossless, all pictures, only the newest one. Beside
them, through the same hub, bare zenoh-python runs with both policies for a full queue: drop and block. Prints one
JSON line with the delivered pictures and the seconds from the first one sent to the last one delivered.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import time
from contextlib import ExitStack

import uvloop
import zenoh
from measuring import free_endpoint, helper, line_of, report, wait_for_end_of_input

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from resource_pool.messages import Frame

MISSION, CLOCK, GRABBER, BARE = "bench", MissionClock(0.0), "resource_pool/framegrabber", "bare/frames"
WAYS = ("lossless", "all", "newest", "bare_drop", "bare_block")
PIXELS = memoryview(bytes(320 * 240))
REST_S = 3.0  # chosen: so long after the last picture was sent, none is on its way any more


def be_hub(endpoint: str) -> None:
    """Run as the hub process."""
    with zenoh.open(hub_config([endpoint])):
        print("ready", flush=True)
        wait_for_end_of_input()


async def listen(endpoint: str, way: str) -> None:
    """Run as a listener; print its count and the arrival of its last picture at the end of input."""
    came_s: list[float] = []

    def came(_one: object) -> None:
        came_s.append(time.monotonic())

    loop, bus = asyncio.get_running_loop(), ZenohBus.open(MISSION, f"backbone/{way}", CLOCK, client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    if way.startswith("bare"):
        bare.declare_subscriber(BARE, lambda sample: loop.call_soon_threadsafe(came, sample.payload.to_bytes()))
    else:
        is_lossless, is_latest = way == "lossless", way == "newest"
        bus.subscribe(GRABBER, Conversation.FRAMES, Frame, came, latest=is_latest, lossless=is_lossless)
    await asyncio.sleep(0.3)  # of the machine: the subscription is known
    print("ready", flush=True)
    await loop.run_in_executor(None, wait_for_end_of_input)
    print(json.dumps([len(came_s), came_s[-1] if came_s else 0.0]), flush=True)
    await bus.close()
    bare.close()


async def send(endpoint: str, way: str, pictures: int) -> None:
    """Run as the sender; print the time of the first picture."""
    bus, bare = ZenohBus.open(MISSION, GRABBER, CLOCK, client_config(endpoint)), zenoh.open(client_config(endpoint))
    control = zenoh.CongestionControl
    publisher = bare.declare_publisher(
        BARE,
        priority=zenoh.Priority.DATA_LOW,
        congestion_control=control.BLOCK if way == "bare_block" else control.DROP,
    )
    await asyncio.sleep(0.3)  # of the machine: the sender knows the subscriptions
    began_s = time.monotonic()
    for number in range(pictures):
        if way.startswith("bare"):
            publisher.put(bytes(PIXELS))
        else:
            bus.publish(GRABBER, Conversation.FRAMES, Frame("grabber", "a", 1, "s", number, 0.0, 320, 240, PIXELS))
    print(json.dumps(began_s), flush=True)
    await asyncio.get_running_loop().run_in_executor(None, wait_for_end_of_input)
    await bus.close()
    bare.close()


def measure(way: str, pictures: int) -> tuple[int, float]:
    """Return the number of pictures that arrived one way, and the seconds until the last one."""
    endpoint = free_endpoint()
    with ExitStack() as running:

        def begin(*arguments: object) -> subprocess.Popen[bytes]:
            return running.enter_context(helper(__file__, *map(str, arguments), answers=True))

        assert line_of(begin("hub", endpoint)) == "ready"
        listener = begin("listener", endpoint, way)
        assert line_of(listener) == "ready"
        began_s = json.loads(line_of(begin("sender", endpoint, way, pictures)))
        time.sleep(REST_S)
        assert listener.stdin is not None
        listener.stdin.close()
        count, last_s = json.loads(line_of(listener))
    return count, round(last_s - began_s, 3)


def main() -> None:
    """Run the role named first, or all of them."""
    match sys.argv[1:]:
        case ["hub", endpoint]:
            be_hub(endpoint)
        case ["listener", endpoint, way]:
            uvloop.run(listen(endpoint, way))
        case ["sender", endpoint, way, pictures]:
            uvloop.run(send(endpoint, way, int(pictures)))
        case _:
            parser = argparse.ArgumentParser(description=__doc__)
            parser.add_argument("--pictures", type=int, default=1000)
            pictures = parser.parse_args().pictures
            found = {way: measure(way, pictures) for way in WAYS}
            report(
                "bursts",
                pictures=pictures,
                bytes=len(PIXELS),
                **{way: {"delivered": count, "last_after_s": last_s} for way, (count, last_s) in found.items()},
            )


if __name__ == "__main__":
    main()
