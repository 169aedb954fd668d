"""Hosts whose buses have boards, on networks of one process."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Annotated

import msgspec
from bus_laws import ASKER, SERVER, Heard, fail_on_bug, until_known, within
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from backbone.ranges import Bulk, Count
from backbone.wire import Message

MISSION, CLOCK = "boards", MissionClock.started_now()
AT, SAID = SERVER, Conversation.FRAMES
PICTURE = 76_800


class Map(Message, frozen=True):
    number: Count
    cells: Bulk


class Sketch(Message, frozen=True):
    number: Count
    text: Annotated[str, msgspec.Meta(max_length=10**9)] = ""


def picture(number: int, size: int = PICTURE) -> Map:
    return Map(number, memoryview(bytes([number % 256]) * size))


class Host:
    """Buses of one host: a folder for their boards, and a hub; counts what goes by the network."""

    def __init__(self, endpoint: str, directory: Path) -> None:
        self.endpoint, self.directory = endpoint, directory
        self.buses: list[ZenohBus] = []

    def join(self, source: str, *, is_near: bool = True) -> ZenohBus:
        bus = ZenohBus.open(MISSION, source, CLOCK, client_config(self.endpoint))
        bus.boards = boards_for(str(self.directory)) if is_near else None
        bus.on_bug = fail_on_bug
        self.buses.append(bus)
        return bus


@asynccontextmanager
async def host(directory: Path) -> AsyncIterator[Host]:
    endpoint = free_endpoint()
    hub = ZenohBus.open(MISSION, "backbone/hub", CLOCK, hub_config([endpoint]))
    made = Host(endpoint, directory)
    try:
        yield made
    finally:
        for bus in made.buses:
            await bus.close()
        await hub.close()


@asynccontextmanager
async def listened_to(
    folder: Path, conversation: Conversation = SAID
) -> AsyncIterator[tuple[Host, ZenohBus, ZenohBus, Heard]]:
    """Give a host, a sender on it, a bus that listens for the sender's newest pictures, and what it hears."""
    async with host(folder) as near:
        sender, listener, heard = near.join(SERVER), near.join(ASKER), Heard()
        listener.subscribe(AT, conversation, Map, heard, latest=True)
        await until_known(listener, sender)
        yield near, sender, listener, heard


async def until(holds: Callable[[], bool], what: str, act: Callable[[], None] = lambda: None) -> None:
    async def wait() -> None:
        while not holds():
            act()
            await asyncio.sleep(0.01)

    await within(wait(), what)


def sending(
    bus: ZenohBus, sent: list[int], size: int = PICTURE, conversation: Conversation = SAID
) -> Callable[[], None]:
    """Return what publishes the next picture."""

    def send() -> None:
        sent.append(len(sent))
        bus.publish(AT, conversation, picture(len(sent), size))

    return send


async def until_near(network: list[int], send: Callable[[], None]) -> None:
    """Publish until nothing goes by the network any more."""

    def is_near() -> bool:
        before = len(network)
        send()
        return len(network) == before

    await until(is_near, "pictures go by the board alone")
