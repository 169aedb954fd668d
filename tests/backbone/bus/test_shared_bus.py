"""What only a shared bus promises: neighbors get the object itself, strangers hear of it once."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Any

import pytest
import pytest_asyncio
from free_ports import free_endpoint

from backbone.bus.clock import MissionClock
from backbone.bus.shared_bus import SharedBus, SharedSession
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.errors import NoResponder
from backbone.keys import Conversation
from backbone.wire import Envelope, Message

DEADLINE_S = 10.0
SCOUT, RADIO = "resource_pool/scout1", "resource_pool/radio"


class Packet(Message, frozen=True):
    number: int = 0


class Sent(Message, frozen=True):
    number: int = 0


@dataclass
class Pool:
    """Two neighbors, a stranger in a process of its own, and the hub."""

    scout: SharedBus
    radio: SharedBus
    stranger: ZenohBus
    hub: ZenohBus
    endpoint: str


@pytest_asyncio.fixture
async def pool() -> AsyncIterator[Pool]:
    endpoint = free_endpoint()
    clock = MissionClock.started_now()
    hub = ZenohBus.open("pool", "backbone/hub", clock, hub_config([endpoint]))
    session = SharedSession("pool", endpoint)
    stranger = ZenohBus.open("pool", "ui_console/stranger", clock, client_config(endpoint))
    it = Pool(session.join(SCOUT, clock), session.join(RADIO, clock), stranger, hub, endpoint)
    yield it
    for bus in (it.scout, it.radio, it.stranger):
        await bus.close()
    await session.close()
    await it.hub.close()


class Heard:
    def __init__(self) -> None:
        self.all: list[Any] = []
        self._more = asyncio.Event()

    def __call__(self, *what: Any) -> None:
        self.all.append(what[0] if len(what) == 1 else what)
        self._more.set()

    async def until(self, holds: Callable[[list[Any]], bool]) -> list[Any]:
        async with asyncio.timeout(DEADLINE_S):
            while not holds(self.all):
                self._more.clear()
                await self._more.wait()
        return self.all


async def until_known(declared_on: Any, to: Any) -> None:
    risen = Heard()
    address = f"{declared_on.source}-mark"
    watching = to.watch_alive(address, risen)
    token = declared_on.declare_alive(address)
    await risen.until(lambda heard: (address, True) in heard)
    watching.close()
    token.close()


async def answer(asked: Envelope[Any]) -> Message:
    return Sent(asked.body.number)


async def test_a_neighbor_is_asked_with_the_object_itself_and_a_stranger_with_a_copy(pool: Pool) -> None:
    asked_with: list[Message] = []
    answered_with = Sent(7)

    async def keep(asked: Envelope[Any]) -> Message:
        asked_with.append(asked.body)
        return answered_with

    pool.radio.serve(RADIO, Packet, keep)
    await until_known(pool.radio, pool.stranger)
    packet = Packet(7)
    assert await pool.scout.ask(RADIO, packet, Sent, within_s=2.0) is answered_with
    assert await pool.stranger.ask(RADIO, packet, Sent, within_s=2.0) == answered_with
    assert asked_with[0] is packet
    assert asked_with[1] == packet
    assert asked_with[1] is not packet


async def test_a_publication_is_heard_once_by_neighbors_strangers_and_its_own_bus(pool: Pool) -> None:
    neighbor, own, stranger = Heard(), Heard(), Heard()
    pool.radio.subscribe("resource_pool/*", Conversation.COMMAND, Packet, neighbor)
    pool.scout.subscribe(SCOUT, Conversation.COMMAND, Packet, own)
    pool.stranger.subscribe(SCOUT, Conversation.COMMAND, Packet, stranger)
    await until_known(pool.stranger, pool.scout)
    packets = [Packet(number) for number in range(50)]
    for packet in packets:
        pool.scout.publish(SCOUT, Conversation.COMMAND, packet)
    for heard in (neighbor, own, stranger):
        await heard.until(lambda all_: len(all_) >= len(packets))
    await until_known(pool.scout, pool.stranger)
    assert all(heard.body is said for heard, said in zip(neighbor.all, packets, strict=True))
    assert [heard.body for heard in own.all] == packets
    assert [heard.body for heard in stranger.all] == packets


async def test_what_strangers_say_is_heard_by_each_neighbor_once(pool: Pool) -> None:
    heard = [Heard(), Heard()]
    for bus, listener in zip((pool.scout, pool.radio), heard, strict=True):
        bus.subscribe("ui_console/*", Conversation.EVENTS, Packet, listener)
        await until_known(bus, pool.stranger)
    for number in range(20):
        pool.stranger.publish("ui_console/stranger", Conversation.EVENTS, Packet(number))
    for listener in heard:
        await listener.until(lambda all_: len(all_) >= 20)
    await until_known(pool.stranger, pool.scout)
    assert [[each.body.number for each in listener.all] for listener in heard] == [list(range(20))] * 2


async def test_each_member_numbers_what_it_says(pool: Pool) -> None:
    heard = Heard()
    pool.stranger.subscribe("resource_pool/*", Conversation.EVENTS, Packet, heard)
    await until_known(pool.stranger, pool.scout)
    for _ in range(2):
        pool.scout.publish(SCOUT, Conversation.EVENTS, Packet())
        pool.radio.publish(RADIO, Conversation.EVENTS, Packet())
    await heard.until(lambda all_: len(all_) == 4)
    assert {each.id for each in heard.all} == {f"{SCOUT}#1", f"{SCOUT}#2", f"{RADIO}#1", f"{RADIO}#2"}
    assert pool.scout.statistics().published == 2


async def test_neighbors_talk_while_there_is_no_hub_and_are_found_again_when_it_is_back(pool: Pool) -> None:
    links, lives = Heard(), Heard()
    pool.radio.serve(RADIO, Packet, answer)
    pool.radio.declare_alive(RADIO)
    pool.scout.watch_alive(RADIO, lives)
    pool.scout.watch_link(links)
    await links.until(lambda all_: all_ == [True])
    await pool.hub.close()
    await links.until(lambda all_: False in all_)
    assert await pool.scout.ask(RADIO, Packet(1), Sent, within_s=2.0) == Sent(1)
    pool.hub = ZenohBus.open("pool", "backbone/hub", MissionClock.started_now(), hub_config([pool.endpoint]))
    there = Heard()
    pool.hub.watch_alive(RADIO, there)
    await there.until(lambda all_: (RADIO, True) in all_)
    await links.until(lambda all_: all_[-1])
    assert lives.all == [(RADIO, True)], "a neighbor's token does not depend on the hub"
    assert await pool.hub.ask(RADIO, Packet(2), Sent, within_s=2.0) == Sent(2)


async def test_a_member_that_leaves_takes_only_its_own_with_it(pool: Pool) -> None:
    pool.radio.serve(RADIO, Packet, answer)
    pool.scout.serve(SCOUT, Packet, answer)
    await until_known(pool.radio, pool.stranger)
    await until_known(pool.scout, pool.stranger)
    await pool.radio.close()
    with pytest.raises(NoResponder):
        await pool.scout.ask(RADIO, Packet(), Sent, within_s=2.0)
    assert await pool.stranger.ask(SCOUT, Packet(3), Sent, within_s=2.0) == Sent(3)


async def test_a_neighbor_that_falls_and_rises_at_once_is_seen_to_do_both(pool: Pool) -> None:
    heard = Heard()
    token = pool.radio.declare_alive(RADIO)
    pool.scout.watch_alive(RADIO, heard)
    await heard.until(lambda all_: len(all_) == 1)
    for _ in range(5):
        token.close()
        token = pool.radio.declare_alive(RADIO)
    await heard.until(lambda all_: len(all_) == 11)
    await until_known(pool.stranger, pool.scout)
    assert heard.all == [(RADIO, True), *[(RADIO, False), (RADIO, True)] * 5]


async def test_a_name_that_moves_to_another_process_is_followed(pool: Pool) -> None:
    """Once the hub knows of the end of the first: two links say it in no order to each other."""
    heard, known_elsewhere = Heard(), Heard()
    token = pool.radio.declare_alive(RADIO)
    pool.scout.watch_alive(RADIO, heard)
    pool.stranger.watch_alive(RADIO, known_elsewhere)
    await heard.until(lambda all_: len(all_) == 1)
    await known_elsewhere.until(lambda all_: len(all_) == 1)
    token.close()
    await heard.until(lambda all_: len(all_) == 2)
    await known_elsewhere.until(lambda all_: len(all_) == 2)
    elsewhere = pool.stranger.declare_alive(RADIO)
    await heard.until(lambda all_: len(all_) == 3)
    elsewhere.close()
    await heard.until(lambda all_: len(all_) == 4)
    assert heard.all == [(RADIO, True), (RADIO, False)] * 2


async def test_a_no_of_the_hub_counts_only_when_the_session_agrees(pool: Pool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The session drops an answer about a token that it reports in the meantime; the hub is then asked again."""
    heard, asked = Heard(), 0
    stands = pool.scout.stands

    async def drop_three(address: str) -> bool:
        nonlocal asked
        asked += 1
        return asked > 3 and await stands(address)

    token = pool.radio.declare_alive(RADIO)
    pool.scout.watch_alive(RADIO, heard)
    await heard.until(lambda all_: len(all_) == 1)
    token.close()
    await heard.until(lambda all_: len(all_) == 2)
    monkeypatch.setattr(pool.scout, "stands", drop_three)
    elsewhere = pool.stranger.declare_alive(RADIO)
    await heard.until(lambda all_: len(all_) == 3)
    elsewhere.close()
    await heard.until(lambda all_: len(all_) == 4)
    assert heard.all == [(RADIO, True), (RADIO, False)] * 2


async def test_members_that_listen_to_the_same_keys_share_a_subscriber_without_a_thread(pool: Pool) -> None:
    """The others go on when one of them leaves, and a listener that comes later hears from then on."""
    first, second, late = Heard(), Heard(), Heard()
    before = threading.active_count()
    listening = [
        bus.subscribe("ui_console/*", Conversation.EVENTS, Packet, heard)
        for bus, heard in ((pool.scout, first), (pool.radio, second))
    ]
    assert threading.active_count() == before
    await until_known(pool.scout, pool.stranger)
    pool.stranger.publish("ui_console/stranger", Conversation.EVENTS, Packet(1))
    await first.until(lambda heard: len(heard) == 1)
    await second.until(lambda heard: len(heard) == 1)
    listening[0].close()
    pool.scout.subscribe("ui_console/*", Conversation.EVENTS, Packet, late)
    pool.stranger.publish("ui_console/stranger", Conversation.EVENTS, Packet(2))
    await second.until(lambda heard: len(heard) == 2)
    await late.until(lambda heard: len(heard) == 1)
    assert [one.body.number for one in first.all] == [1]
    assert threading.active_count() == before
