"""Outputs between neighbors: handed over as objects, and encoded only while another process hears them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from free_ports import free_endpoint
from hosts_with_boards import until

from backbone.bus import zenoh_outlets
from backbone.bus.clock import MissionClock
from backbone.bus.shared_bus import SharedBus, SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from backbone.wire import Envelope, Message

WITHIN_S = 10.0
UNIT, TAKER = "mission_control/unit", "mission_control/taker"
OUTPUT = f"{UNIT}/ball"


class Ball(Message, frozen=True):
    number: int


@pytest.fixture
def encoded(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the numbers of the balls that were encoded."""
    numbers: list[int] = []
    write = zenoh_outlets.write

    def counting(envelope: Envelope[Message], *limit: int) -> bytes:
        if isinstance(envelope.body, Ball):
            numbers.append(envelope.body.number)
        return write(envelope, *limit)

    monkeypatch.setattr(zenoh_outlets, "write", counting)
    monkeypatch.setattr(zenoh_outlets, "KNOWN_AFTER_S", 0.0)
    return numbers


@pytest_asyncio.fixture(params=["without a folder", "with the mission's folder"])
async def buses(
    request: pytest.FixtureRequest, short_path: Path
) -> AsyncIterator[tuple[SharedBus, SharedBus, ZenohBus]]:
    """Give the buses of two neighbors and of a stranger; with a folder, large values go by blackboards."""
    directory = str(short_path) if request.param.startswith("with ") else ""
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open("pool", "backbone/hub", clock, hub_config([endpoint]))
    session = SharedSession("pool", endpoint, directory=directory)
    neighbors = session.join(UNIT, clock), session.join(TAKER, clock)
    stranger = ZenohBus.open("pool", "ui_console/stranger", clock, client_config(endpoint))
    yield *neighbors, stranger
    for bus in (*neighbors, stranger):
        await bus.close()
    await session.close()
    await hub.close()


async def test_outputs_to_neighbors_are_not_encoded_until_another_process_hears_them(
    buses: tuple[SharedBus, SharedBus, ZenohBus], encoded: list[int]
) -> None:
    unit, taker, stranger = buses
    here: asyncio.Queue[Ball] = asyncio.Queue()
    there: asyncio.Queue[Ball] = asyncio.Queue()
    taker.subscribe(OUTPUT, Conversation.OUTPUTS, Ball, lambda one: here.put_nowait(one.body), latest=True)
    async with asyncio.timeout(WITHIN_S):
        for number in range(100):
            sent = Ball(number)
            unit.publish(OUTPUT, Conversation.OUTPUTS, sent)
            assert await here.get() is sent
        assert encoded == []

        listening = stranger.subscribe(OUTPUT, Conversation.OUTPUTS, Ball, lambda one: there.put_nowait(one.body))
        number = 100
        while there.empty():
            unit.publish(OUTPUT, Conversation.OUTPUTS, Ball(number))
            number += 1
            await here.get()
            await asyncio.sleep(0.001)
        assert (await there.get()).number == encoded[0]
        assert encoded[0] < number
        listening.close()


async def test_a_new_publisher_encodes_until_it_knows_who_hears(
    buses: tuple[SharedBus, SharedBus, ZenohBus], encoded: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zenoh_outlets, "KNOWN_AFTER_S", WITHIN_S)
    unit, _taker, _stranger = buses
    unit.publish(OUTPUT, Conversation.OUTPUTS, Ball(1))
    unit.publish(OUTPUT, Conversation.EVENTS, Ball(2))
    assert encoded == [1, 2]


async def test_only_outputs_go_unsent_because_the_next_one_follows(
    buses: tuple[SharedBus, SharedBus, ZenohBus], encoded: list[int]
) -> None:
    unit, _taker, _stranger = buses
    unit.publish(OUTPUT, Conversation.OUTPUTS, Ball(1))
    unit.publish(OUTPUT, Conversation.EVENTS, Ball(2))
    assert encoded == [2]


@pytest.mark.usefixtures("encoded")
async def test_a_bus_knows_soon_whether_certainly_nobody_hears_it(buses: tuple[SharedBus, SharedBus, ZenohBus]) -> None:
    unit, taker, stranger = buses

    def unheard() -> bool:
        return unit.is_unheard(Conversation.SCHEDULE)

    await until(unheard, "the bus knows that no listener is there")
    listeners = [
        lambda: taker.subscribe(UNIT, Conversation.SCHEDULE, Ball, lambda _one: None),
        lambda: stranger.subscribe(UNIT, Conversation.SCHEDULE, Ball, lambda _one: None),
        lambda: stranger.subscribe("*/*", Conversation.SCHEDULE, Ball, lambda _one: None, latest=True),
        lambda: stranger.subscribe(UNIT, Conversation.SCHEDULE, Ball, lambda _one: None, lossless=True),
        lambda: stranger.overhear(Conversation.SCHEDULE, lambda _key, _raw: None, 1_000_000),
        lambda: stranger.overhear(Conversation.TOLD, lambda _key, _raw: None, 1_000_000),
    ]
    for listen in listeners:
        listening = listen()
        await until(lambda: not unheard(), "the bus knows the listener")
        listening.close()
        await until(unheard, "the bus knows that the listener has left")
