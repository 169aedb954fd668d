"""Observes a running mission from outside, as JSON lines: a look every 50 ms and the arrival of each picture.

It is a process of its own, so that observing and measuring do not wait for each other. It uses one bus connection and
is not a component. It ends when its standard input closes.

Lines: ``{"began", "t", "sight"}`` for a look (``sight`` is omitted if it equals that of the preceding look),
``{"frame"}`` for a picture. Times are this machine's monotonic clock.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.launcher.mission_connection import connected
from backbone.naming import component_of
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture
from resource_pool.messages import Frame

LOOK_EVERY_S = 0.05
UNREACHABLE = "unreachable"  # stands for the end of ``status`` with exit code 4


def sight(picture: MissionPicture) -> dict[str, Any]:
    """Return the relevant parts of a picture, as plain data."""
    verdict = picture.health
    schedule = picture.schedule
    return {
        "word": str(verdict.word),
        "absent": [absence.name for absence in verdict.absent],
        "why": [f"{absence.name}: {absence.cause}; {absence.doing}" for absence in verdict.absent],
        "rows": {component_of(at): [c.pid, str(c.state)] for at, c in sorted(picture.components.items())},
        "restarts": {name: process.restarts for name, process in sorted(picture.processes.items())},
        "asks": sorted(request.arc for request in schedule.requests) if schedule else [],
        "held": sorted({holder.arc for rc in schedule.rcs for holder in rc.holders}) if schedule else [],
    }


def say(**said: Any) -> None:
    """Write one line."""
    sys.stdout.write(json.dumps(said) + "\n")
    sys.stdout.flush()


async def watch(bus: Bus, clock: MissionClock) -> None:
    """Observe repeatedly."""
    last: dict[str, Any] = {}
    while True:
        began = time.monotonic()
        try:
            seen = sight(await look(bus, clock.now_s(), rate=clock.rate))
        except (LinkError, Refusal) as error:
            seen = {"word": UNREACHABLE, "absent": [], "why": [str(error)]}
        say(began=began, t=time.monotonic(), **({} if seen == last else {"sight": seen}))
        last = seen
        await asyncio.sleep(max(0.0, began + LOOK_EVERY_S - time.monotonic()))


async def attend(mission: str) -> None:
    """Observe the mission."""
    async with connected(mission, None, "ui_console/recovery") as (bus, clock):
        say(origin=clock.origin_monotonic_s)
        bus.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda _envelope: say(frame=time.monotonic()))
        await watch(bus, clock)


async def observe(mission: str) -> None:
    """Observe the mission until standard input closes."""
    closed = asyncio.get_running_loop().run_in_executor(None, sys.stdin.buffer.read)
    attending = asyncio.create_task(attend(mission))
    await asyncio.wait({closed, attending}, return_when=asyncio.FIRST_COMPLETED)
    attending.cancel()
    await asyncio.wait({attending})
    if not attending.cancelled():
        attending.result()


if __name__ == "__main__":
    asyncio.run(observe(sys.argv[1]))
