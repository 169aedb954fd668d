"""A hub and components that ask it, answer, or send pictures, each a process for one machine of a test.

``bus_roles.py hub|crowd|asker|cameras|watcher ENDPOINT NUMBER``
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.bus.zenoh_threads import threads_of_a_hub
from backbone.errors import LinkError
from backbone.keys import Conversation
from backbone.operating_system.lingering import ignore_lingering
from backbone.rc_manager.messages import Beat, Done, SetIdle
from backbone.wire import Envelope, Message
from resource_pool.messages import Frame

if TYPE_CHECKING:
    from namespaces import NetworkHost

MISSION, HUB, BEAT_EVERY_S, ASKED_EVERY_S = "cable", "backbone/hub", 0.05, 0.05
CROWD = 16  # more than the threads through which a hub receives
ANSWERED_WITHIN_S = 1.0  # as long as an answer may take on a busy machine
NARROW_ANSWERED_WITHIN_S = 10.0  # behind pictures, on a link that loses what it cannot pass
CAMERAS, WIDTH_PX, HEIGHT_PX, FRAME_EVERY_S = ("left", "right"), 320, 240, 0.125


def member(number: int) -> str:
    """Return the address of one of the crowd."""
    return f"resource_pool/member-{number}"


async def answer(_asked: Envelope[Any]) -> Message:
    return Done()


async def is_answered(bus: ZenohBus, address: str, within_s: float = ANSWERED_WITHIN_S) -> bool:
    try:
        await bus.ask(address, SetIdle("arc", True), Done, within_s=within_s)
    except LinkError:
        return False
    return True


async def hub(endpoint: str, _number: int) -> None:
    """Answer until killed."""
    threads_of_a_hub()
    ignore_lingering()
    bus = ZenohBus.open(MISSION, HUB, MissionClock.started_now(), hub_config([endpoint]))
    bus.serve(HUB, SetIdle, answer)
    say("ready")
    await asyncio.Event().wait()


async def crowd(endpoint: str, number: int) -> None:
    """Be so many components that publish and answer, each on a link of its own, until killed."""
    clock = MissionClock.started_now()
    buses = [ZenohBus.open(MISSION, member(n), clock, client_config(endpoint)) for n in range(number)]
    for bus in buses:
        bus.serve(bus.source, SetIdle, answer)
        bus.declare_alive(bus.source)
    say("ready")
    while True:
        for bus in buses:
            bus.publish(bus.source, Conversation.BEAT, Beat("arc"))
        await asyncio.sleep(BEAT_EVERY_S)


async def asker(endpoint: str, number: int) -> None:
    """Ask the hub until a line comes; then say how many questions were not answered, and who of the crowd is deaf."""
    clock = MissionClock.started_now()
    bus = await ZenohBus.open_when_up(MISSION, "ui_console/asker", clock, client_config(endpoint))
    bus.subscribe("resource_pool/*", Conversation.BEAT, Beat, lambda _beat: None)
    line = asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    asked = unanswered = 0
    say("ready")
    while not line.done():
        asked += 1
        unanswered += not await is_answered(bus, HUB)
        await asyncio.sleep(ASKED_EVERY_S)
    say(json.dumps({"asked": asked, "unanswered": unanswered}))
    within_s = float(await line)
    deaf, until_s = set(range(number)), clock.now_s() + within_s
    while deaf and clock.now_s() < until_s:
        deaf -= {n for n in sorted(deaf) if await is_answered(bus, member(n))}
    say(json.dumps({"deaf": sorted(deaf)}))
    await bus.close()


async def cameras(endpoint: str, _number: int) -> None:
    """Be two cameras, until killed."""
    bus = await ZenohBus.open_when_up(
        MISSION, "resource_pool/grabber", MissionClock.started_now(), client_config(endpoint)
    )
    say("ready")
    for number in itertools.count():
        pixels = os.urandom(WIDTH_PX * HEIGHT_PX)
        for arc in CAMERAS:
            frame = Frame("grabber", arc, 1, "scout", number, 0.0, WIDTH_PX, HEIGHT_PX, pixels)
            bus.publish(f"resource_pool/{arc}", Conversation.FRAMES, frame)
        await asyncio.sleep(FRAME_EVERY_S)


async def watcher(endpoint: str, _number: int) -> None:
    """Get the cameras' pictures and ask the hub until a line comes; then say what came, and how often no link was."""
    bus = await ZenohBus.open_when_up(
        MISSION, "mission_control/watch", MissionClock.started_now(), client_config(endpoint)
    )
    count = Counter[str]()
    bus.watch_link(lambda up: count.update([] if up else ["cut"]))
    for arc in CAMERAS:
        at = f"resource_pool/{arc}"
        bus.subscribe(at, Conversation.FRAMES, Frame, lambda _frame: count.update(["pictures"]), latest=True)
    line = asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    say("ready")
    while not line.done():
        count["asked"] += 1
        count["unanswered"] += not await is_answered(bus, HUB, NARROW_ANSWERED_WITHIN_S)
        await asyncio.sleep(ASKED_EVERY_S)
    say(json.dumps(count))
    await bus.close()


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


@contextlib.contextmanager
def playing(role: str, host: NetworkHost, endpoint: str) -> Iterator[subprocess.Popen[str]]:
    """Give a role when it is ready; it is killed afterwards."""
    command = [sys.executable, __file__, role, endpoint, str(CROWD)]
    with host.start(command, dict(os.environ), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            assert said_by(process) == "ready"
            yield process
        finally:
            process.kill()


def said_by(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


if __name__ == "__main__":
    roles = {"hub": hub, "crowd": crowd, "asker": asker, "cameras": cameras, "watcher": watcher}
    asyncio.run(roles[sys.argv[1]](sys.argv[2], int(sys.argv[3])))
