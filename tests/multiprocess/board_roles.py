"""Processes that write to a blackboard and read from it, alone or by the bus, until they are killed.

``board_roles.py writer|reader FOLDER NUMBER`` or ``board_roles.py sender|listener FOLDER ENDPOINT``
"""

from __future__ import annotations

import asyncio
import itertools
import sys
import threading
from pathlib import Path

import numpy as np

from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.values import NoWriter, Value
from backbone.blackboard.writer import BlackboardWriter
from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.keys import Conversation
from backbone.ranges import Bulk, Count
from backbone.wire import Message

NAME, MISSION, SENDER, WITHIN_S = "room", "boards", "backbone/sender", 20.0
SIZES = (76_800, 100, 300_000, 0, 131_072, 131_073)


class Map(Message, frozen=True):
    number: Count
    cells: Bulk


def is_whole(value: Value) -> bool:
    """Return whether all bytes of a value are those that belong to its number."""
    cells = np.frombuffer(value.data, np.uint8)
    return bool(len(cells) == SIZES[value.number % len(SIZES)] and (cells == value.number % 251).all())


def write(folder: Path, pause_ms: int) -> None:
    """Write until killed."""
    writer = BlackboardWriter(folder, NAME)
    writer.serve_in_thread()
    say("ready")
    pause = threading.Event()
    for number in itertools.count(1):
        writer.put(bytes([number % 251]) * SIZES[number % len(SIZES)])
        pause.wait(pause_ms / 1000)


def read(folder: Path, count: int) -> None:
    """Read so many values and say how many were torn or came out of order."""
    reader, wrong, last = BlackboardReader(folder, NAME), 0, 0
    say("ready")
    for _ in range(count):
        value = reader.wait(WITHIN_S)
        if value is None:
            raise TimeoutError
        wrong += not (is_whole(value) and value.number > last)
        last = value.number
    say(str(wrong))


async def send(folder: Path, endpoint: str) -> None:
    """Publish pictures until killed."""
    bus = ZenohBus.open(MISSION, SENDER, MissionClock(0.0), client_config(endpoint))
    bus.boards = boards_for(str(folder))
    say("ready")
    for number in itertools.count(1):
        bus.publish(SENDER, Conversation.FRAMES, Map(number, memoryview(bytes(76_800))))
        await asyncio.sleep(0.01)


async def listen(folder: Path, endpoint: str) -> None:
    """Listen to pictures until killed."""
    bus = ZenohBus.open(MISSION, "backbone/other", MissionClock(0.0), client_config(endpoint))
    bus.boards = boards_for(str(folder))
    heard = asyncio.Event()
    bus.subscribe(SENDER, Conversation.FRAMES, Map, lambda _one: heard.set(), latest=True)
    await heard.wait()
    say("ready")
    await asyncio.Event().wait()


def say(what: str) -> None:
    print(what, flush=True)


if __name__ == "__main__":
    role, place, more = sys.argv[1:]
    try:
        match role:
            case "writer":
                write(Path(place), int(more))
            case "reader":
                read(Path(place), int(more))
            case "sender":
                asyncio.run(send(Path(place), more))
            case "listener":
                asyncio.run(listen(Path(place), more))
    except NoWriter:
        say("ended")
