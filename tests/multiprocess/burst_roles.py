"""A hub and listeners to a burst of pictures, each a process of its own.

``burst_roles.py hub|"spare hub" ENDPOINT`` or ``burst_roles.py every|newest|lossless|recorder ENDPOINT``
"""

from __future__ import annotations

import asyncio
import json
import sys

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from backbone.wire import Reader
from resource_pool.messages import Frame

MISSION, GRABBER = "burst", "resource_pool/framegrabber1"


async def hub(endpoint: str, *, waits: bool) -> None:
    """Serve until killed; if it waits, from a line on."""
    if waits:
        say("ready")
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    serving = ZenohBus.open(MISSION, "backbone/hub", MissionClock(0.0), hub_config([endpoint]))
    say("ready")
    await asyncio.Event().wait()
    await serving.close()


async def listen(how: str, endpoint: str) -> None:
    """Listen until a line comes; then say which pictures came, and how many were counted as dropped."""
    bus = await ZenohBus.open_when_up(MISSION, f"mission_control/{how}", MissionClock(0.0), client_config(endpoint))
    numbers: list[int] = []
    reader = Reader(Frame)
    if how == "recorder":
        bus.overhear(
            Conversation.FRAMES, lambda _key, raw: numbers.append(reader.read(raw).body.number), 1, lossless=True
        )
    else:
        bus.subscribe(
            GRABBER,
            Conversation.FRAMES,
            Frame,
            lambda one: numbers.append(one.body.number),
            latest=how == "newest",
            lossless=how == "lossless",
        )
    bus.declare_alive(bus.source)
    say("ready")
    while await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline):
        say(json.dumps({"numbers": numbers, "dropped": sum(bus.dropped().values())}))
    await bus.close()


def say(text: str) -> None:
    """Print a line at once."""
    print(text, flush=True)


if __name__ == "__main__":
    role, at = sys.argv[1:]
    asyncio.run(hub(at, waits=role == "spare hub") if role.endswith("hub") else listen(role, at))
