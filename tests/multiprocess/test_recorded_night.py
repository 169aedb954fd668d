"""A recorded night: what components counted as sent is in the recording, each message once, in its order."""

from __future__ import annotations

import asyncio
import json
import signal
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest
from consoles_at_work import Console, consoles_at_work
from mcap.reader import make_reader
from patrol_at_work import counted
from running_mission import BIN, RunningMission, mission_up

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.command_line.message_lines import short_key
from backbone.keys import Conversation
from backbone.quality import NEVER_DROPPED
from backbone.recording.reader import Recorded, Recording
from ui_console.model.driving import DriveWish

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

WITHIN_S = 30.0
HOSTS = ("near", "far")
OPERATORS = {"scout3": ("console-anna", 90), "scout4": ("console-ben", 100)}
SCOUT3 = """<resource type="scout" name="scout3" features="camera" driver="simulated" process="hardware">"""
SCOUT4 = """<resource type="scout" name="scout4" driver="simulated">
      <uses type="command_radio" name="radio"/>
      <parameter name="network_id" value="4"/>
    </resource>
    """
STANDS = '<robot name="scout3" x-m="4.50" y-m="1.200" heading-deg="90"/>'
UP_BEFORE = {NAMESERVER, LAUNCHER}  # they send their first messages before there is a recorder
CHANGE = {
    SCOUT3: SCOUT4 + SCOUT3.replace(' process="hardware"', ""),
    STANDS: f'{STANDS}<robot name="scout4" x-m="6.00" y-m="1.200" heading-deg="90"/>',
}


@asynccontextmanager
async def offered(mission: RunningMission, host: str) -> AsyncIterator[None]:
    """Have a further creator, for a host of this name."""
    words = ("creator", "--host", host, "--connect", mission.endpoint, "--mission", mission.name)
    creator = await asyncio.create_subprocess_exec(str(BIN / "scout-backbone"), *words, env=mission.environment)
    try:
        async with asyncio.timeout(WITHIN_S):
            while f"creator-{host}" not in await names(mission):
                assert creator.returncode is None
        yield
        creator.send_signal(signal.SIGINT)
        async with asyncio.timeout(WITHIN_S):
            assert await creator.wait() == 0
    finally:
        if creator.returncode is None:
            creator.kill()
            await creator.wait()


async def names(mission: RunningMission) -> dict[str, str]:
    """Return name → address of the components."""
    status = await asyncio.to_thread(mission.status)
    return {one["name"]: f"{one['subsystem']}/{one['name']}" for one in status["components"]}


async def moved(mission: RunningMission, robot: str, host: str) -> None:
    """Have the robot's RC run on this host."""
    for words in (("stop", robot), ("start", "scout", "--name", robot, "--host", host)):
        done = await asyncio.to_thread(mission.command, "scout-backbone", *words, "--mission", mission.name)
        assert done.returncode == 0, done.stderr


async def drive(console: Console, until_s: float) -> None:
    """Take the robot, drive and give it back until that time."""
    dice = Random(console.name)
    while console.clock.now_s() < until_s:
        await console.take_and_drive(DriveWish(dice.uniform(-2, 2), dice.uniform(-2, 2)))
        await asyncio.sleep(dice.uniform(0.1, 1.0))
        await console.give_back()
        await asyncio.sleep(dice.uniform(0.0, 0.3))


@pytest.mark.thorough
@pytest.mark.parametrize("lasts_s", [5.0, pytest.param(60.0, marks=pytest.mark.slow)])
async def test_all_that_components_counted_as_sent_is_recorded_once_and_in_order(
    tmp_path: Path, lasts_s: float
) -> None:
    path = tmp_path / "night.mcap"
    with mission_up("--record", str(path), change=CHANGE) as mission:
        sent = await play(mission, lasts_s)
        assert await asyncio.to_thread(mission.down) == 0, mission.story()
        done = mission.command("scout-backbone", "recording", "check", str(path), "--json")
    assert done.returncode == 0, done.stderr
    checked = json.loads(done.stdout)
    with path.open("rb") as file:
        assert checked["messages"] == sum(1 for _message in make_reader(file).iter_messages())
    with path.open("rb") as file:
        found = [*Recording(file).messages()]
    assert len(sent) > 20, sorted(sent)
    for address, values in sent.items():
        judge(address, found, values)


async def play(mission: RunningMission, lasts_s: float) -> dict[str, dict[str, float]]:
    """Return the statistics of all components, address by address, after so many seconds of work on three hosts."""
    async with AsyncExitStack() as stack:
        bus = await stack.enter_async_context(mission.bus("ui_console/onlooker"))
        consoles = []
        for host, (robot, person) in zip(HOSTS, OPERATORS.items(), strict=True):
            await stack.enter_async_context(offered(mission, host))
            await moved(mission, robot, host)
            consoles += await stack.enter_async_context(consoles_at_work(mission, bus, robot, [person]))
        until_s = mission.clock.now_s() + lasts_s
        await asyncio.gather(*(drive(console, until_s) for console in consoles))
        return {address: await counted(bus, address) for address in (await names(mission)).values()}


def judge(address: str, found: list[Recorded], values: dict[str, float]) -> None:
    """See that all that the component counted is recorded, each number once, in order.

    Only messages that are repeated, and may be dropped by the bus, may be missing.
    """
    life = last_life(found, address)
    numbers = [message.sequence for message in life]
    assert all(earlier < later for earlier, later in pairwise(numbers)), f"{address}: {numbers}"
    own = f"{address}/{Conversation.ASK}"
    asked_there = {message.id for message in found if short_key(message.key) == own}
    counts = Counter(kind_of(message, own, asked_there) for message in life)
    told = f"{address}: {dict(counts)} from number {numbers[0]} to {numbers[-1]}, counted {values}"
    unanswered = values["bus_asked"] - counts["question"]
    dropped = values["bus_published"] - counts["sent once"] - counts["repeated"]
    if address in UP_BEFORE:
        return
    assert values["bus_answered"] == counts["answer"], told
    assert unanswered == 0, told
    assert dropped >= 0, told
    assert numbers[-1] - len(numbers) == dropped, told


def last_life(found: list[Recorded], source: str) -> list[Recorded]:
    """Return the messages of a component from its last start, where it numbers anew, to its statistics."""
    life: list[Recorded] = []
    for message in found:
        if message.source == source:
            if message.sequence == 1:
                life.clear()
            life.append(message)
            if message.schema.startswith("Statistics/"):
                return life
    raise AssertionError(f"{source}: its statistics are not recorded")


def kind_of(message: Recorded, own: str, asked_there: set[str]) -> str:
    """Return how the component's bus counts the message.

    Args:
        own: Key of questions to the component.
        asked_there: Ids of all messages at that key; an answer names its question as its cause.
    """
    conversation = message.key.rpartition("/")[2]
    if conversation != Conversation.ASK:
        return "sent once" if conversation in NEVER_DROPPED else "repeated"
    return "answer" if short_key(message.key) == own and message.cause in asked_there else "question"
