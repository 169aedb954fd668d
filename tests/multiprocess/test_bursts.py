"""Pictures sent at once to listeners in processes of their own: a lossless one gets all, and delays nobody."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import burst_roles
import pytest
import pytest_asyncio
from burst_roles import GRABBER, MISSION
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.keys import Conversation
from resource_pool.messages import Frame

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]
MANY, WITHIN_S = 1000, 30.0
PIXELS = memoryview(bytes(320 * 240))
Process = subprocess.Popen[str]


class Processes:
    """A hub and listeners; kills those that are left."""

    def __init__(self) -> None:
        self.endpoint, self._all = free_endpoint(), list[Process]()

    def begin(self, role: str) -> Process:
        command = [sys.executable, burst_roles.__file__, role, self.endpoint]
        made = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._all.append(made)
        assert line_of(made) == "ready"
        return made

    def end(self) -> None:
        for one in self._all:
            one.send_signal(signal.SIGKILL)
            one.communicate(timeout=WITHIN_S)


def line_of(one: Process) -> str:
    assert one.stdout is not None
    return one.stdout.readline().strip()


def heard_by(one: Process) -> dict[str, Any]:
    assert one.stdin is not None
    one.stdin.write("\n")
    one.stdin.flush()
    told: dict[str, Any] = json.loads(line_of(one))
    return told


@pytest.fixture
def processes() -> Iterator[Processes]:
    made = Processes()
    yield made
    made.end()


@pytest_asyncio.fixture
async def sender(processes: Processes) -> AsyncIterator[ZenohBus]:
    processes.begin("hub")
    bus = await ZenohBus.open_when_up(MISSION, GRABBER, MissionClock(0.0), client_config(processes.endpoint))
    yield bus
    await bus.close()


async def known(sender: ZenohBus, *roles: str) -> None:
    """Return when the listeners' tokens, which they declare last, are known."""
    missing = set(roles)
    watching = sender.watch_alive(
        "mission_control/*", lambda address, alive: missing.discard(address.partition("/")[2]) if alive else None
    )
    await until(lambda: not missing, f"tokens of {missing}")
    watching.close()


async def until(holds: Callable[[], bool], what: str) -> None:
    until_s = time.monotonic() + WITHIN_S
    while not holds():
        assert time.monotonic() < until_s, f"not within {WITHIN_S:g} s: {what}"
        await asyncio.sleep(0.05)


def send(sender: ZenohBus, number: int) -> float:
    """Publish a picture; return the seconds for which the sender was busy with it."""
    began_s = time.monotonic()
    sender.publish(
        GRABBER, Conversation.FRAMES, Frame("framegrabber1", "watch", 1, "scout1", number, 0.0, 320, 240, PIXELS)
    )
    return time.monotonic() - began_s


async def test_of_a_thousand_pictures_sent_at_once_a_lossless_listener_gets_all(
    processes: Processes, sender: ZenohBus
) -> None:
    every, newest, recorder = (processes.begin(role) for role in ("lossless", "newest", "recorder"))
    await known(sender, "lossless", "newest", "recorder")
    for number in range(MANY):
        send(sender, number)
    for one in (every, recorder):
        await until(lambda one=one: len(heard_by(one)["numbers"]) == MANY, "a thousand pictures")  # type: ignore[misc]
        assert heard_by(one) == {"numbers": list(range(MANY)), "dropped": 0}
    numbers = heard_by(newest)["numbers"]
    assert 0 < len(numbers) < MANY
    assert numbers == sorted(set(numbers))


@pytest.mark.alone  # it measures how long the sender is busy
async def test_a_lossless_listener_that_hangs_delays_nobody_and_gets_all_when_it_goes_on(
    processes: Processes, sender: ZenohBus
) -> None:
    hung, other = processes.begin("lossless"), processes.begin("every")
    await known(sender, "lossless", "every")
    hung.send_signal(signal.SIGSTOP)
    longest_s = 0.0
    for number in range(100):
        longest_s = max(longest_s, send(sender, number))
        await asyncio.sleep(0.012)
    seen = heard_by(other)["numbers"]
    hung.send_signal(signal.SIGCONT)
    assert longest_s < 0.5, "nobody waits for it, not even as long as for a subscriber of what is sent once"
    assert len(seen) > 90
    await until(lambda: len(heard_by(hung)["numbers"]) == 100, "what was sent meanwhile")
    assert heard_by(hung) == {"numbers": list(range(100)), "dropped": 0}


@pytest.mark.alone  # senders keep what they could not send for 2 s
async def test_a_hub_that_is_killed_costs_a_lossless_listener_nothing(processes: Processes) -> None:
    hub, spare = processes.begin("hub"), processes.begin("spare hub")
    sender = await ZenohBus.open_when_up(MISSION, GRABBER, MissionClock(0.0), client_config(processes.endpoint))
    listener = processes.begin("lossless")
    await known(sender, "lossless")
    for number in range(90):
        if number == 30:
            hub.kill()
            hub.wait(WITHIN_S)
        if number == 60:
            assert spare.stdin is not None
            spare.stdin.write("\n")
            spare.stdin.flush()
            assert line_of(spare) == "ready"
        send(sender, number)
        await asyncio.sleep(0.005)
    await until(lambda: len(heard_by(listener)["numbers"]) == 90, "all, those sent without a hub, too")
    assert heard_by(listener) == {"numbers": list(range(90)), "dropped": 0}
    await sender.close()
