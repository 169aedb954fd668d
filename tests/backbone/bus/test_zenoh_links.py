"""A link over TCP that passes no messages is replaced; one that passes them stays."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
import zenoh
from bus_laws import Echo, Echoed
from free_ports import free_endpoint
from test_zenoh_questions import echo

from backbone.bus import zenoh_links
from backbone.bus.clock import MissionClock
from backbone.bus.shared_bus import SharedSession
from backbone.bus.sockets import MOST_UNSENT_BYTES
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.bus.zenoh_life import LifeBus
from backbone.keys import KEY_OF_HUB, Conversation

MISSION, CLIENT, RC = "links", "ui_console/client", "resource_pool/rc"
RC_REPLY_S = 0.8  # as long as an ARC waits for its RC (resource_pool/arc_slice.py)
NOTICED_WITHIN_S = 10.0
LONGEST_KEEP_ALIVE = 2  # bytes, in zenoh 1.10
SHORTEST_PICTURE = 1000  # bytes; answers are shorter


@pytest.fixture(autouse=True)
def quick_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_links, "LOOK_EACH_S", 0.05)
    monkeypatch.setattr(zenoh_links, "ANSWER_WITHIN_S", 0.1)


async def changes(bus: LifeBus, number: int, within_s: float = NOTICED_WITHIN_S) -> list[bool]:
    """Return whether the link came or went, so many times or until the time is over."""
    seen: list[bool] = []
    enough = asyncio.Event()

    def changed(up: bool) -> None:
        seen.append(up)
        if len(seen) == number:
            enough.set()

    watching = bus.watch_link(changed)
    try:
        async with asyncio.timeout(within_s):
            await enough.wait()
    except TimeoutError:
        pass
    finally:
        watching.close()
    return seen[:number]


@pytest.mark.parametrize("shared", [False, True])
async def test_a_link_without_messages_is_replaced_until_messages_pass(shared: bool) -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = await asyncio.to_thread(zenoh.open, hub_config([endpoint]))  # says nothing, as a deaf link
    session = SharedSession(MISSION, endpoint) if shared else None
    bus = session.join(CLIENT, clock) if session else ZenohBus.open(MISSION, CLIENT, clock, client_config(endpoint))
    try:
        assert await changes(bus, 4) == [True, False, True, False]
        token = hub.liveliness().declare_token(KEY_OF_HUB)
        async with asyncio.timeout(NOTICED_WITHIN_S):
            while (await changes(bus, 9, within_s=1.0))[-1:] != [True]:
                pass  # the link of that moment may still be replaced
        assert await changes(bus, 2, within_s=0.5) == [True]
        token.undeclare()  # type: ignore[no-untyped-call]
    finally:
        await bus.close()
        if session:
            await session.close()
        await asyncio.to_thread(hub.close)


@asynccontextmanager
async def a_deaf_connection_first(hub_port: int, delay_s: float = 0.0) -> AsyncIterator[tuple[int, asyncio.Event]]:
    """Give a port through which a hub is reached, and what keeps the answers of the first connection back.

    Keep-alives and pictures pass it.

    Args:
        delay_s: Of each message on its way.
    """
    is_deaf, streams, tasks = asyncio.Event(), list[asyncio.StreamWriter](), set[asyncio.Task[None]]()

    async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, may_be_deaf: bool) -> None:
        try:
            while True:
                length = await reader.readexactly(2)
                batch = await reader.readexactly(int.from_bytes(length, "little"))
                is_other = not LONGEST_KEEP_ALIVE < len(batch) < SHORTEST_PICTURE
                if is_other or not (may_be_deaf and is_deaf.is_set()):
                    asyncio.get_running_loop().call_later(delay_s, writer.write, length + batch)
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        hub_reader, hub_writer = await asyncio.open_connection("127.0.0.1", hub_port)
        is_first = not streams
        streams.extend((writer, hub_writer))
        tasks.add(asyncio.create_task(carry(reader, hub_writer, may_be_deaf=False)))
        tasks.add(asyncio.create_task(carry(hub_reader, writer, may_be_deaf=is_first)))

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1], is_deaf
    finally:
        server.close()
        for stream in streams:
            stream.close()
        await asyncio.gather(*tasks, return_exceptions=True)


async def test_a_link_that_only_keeps_itself_alive_is_replaced() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    async with a_deaf_connection_first(int(endpoint.rpartition(":")[2])) as (port, is_deaf):
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(f"tcp/127.0.0.1:{port}"))
        is_deaf.set()
        try:
            assert await changes(bus, 3) == [True, False, True]
            assert await changes(bus, 2, within_s=0.5) == [True]
        finally:
            await bus.close()
    await hub.close()


async def test_a_link_over_which_pictures_come_stays_although_answers_are_late(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_links, "ANSWER_WITHIN_S", 0.4)
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))

    async def send_pictures() -> None:
        while True:
            hub.publish(RC, Conversation.FRAMES, Echo("x" * 2 * SHORTEST_PICTURE))
            await asyncio.sleep(0.01)

    async with a_deaf_connection_first(int(endpoint.rpartition(":")[2])) as (port, is_deaf):
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(f"tcp/127.0.0.1:{port}"))
        is_deaf.set()
        bus.subscribe(RC, Conversation.FRAMES, Echo, lambda _picture: None)
        sending = asyncio.create_task(send_pictures())
        try:
            assert await changes(bus, 2, within_s=3.0) == [True]  # without pictures it is replaced after 1 s
        finally:
            sending.cancel()
            await bus.close()
    await hub.close()


def unsent_limits(port: int) -> list[int]:
    """Return how many unsent bytes the system keeps at most, for each end of the connections to a port."""
    limits = []
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(OSError), socket.fromfd(int(entry.name), socket.AF_INET, socket.SOCK_STREAM) as one:
            if (port,) in (one.getsockname()[1:], one.getpeername()[1:]):
                limits.append(one.getsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT))
    return limits


async def test_of_a_link_the_system_keeps_few_bytes_that_no_urgent_message_overtakes() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    bus = ZenohBus.open(MISSION, CLIENT, clock, client_config(endpoint))
    try:
        assert await changes(bus, 1) == [True]
        both, port = [MOST_UNSENT_BYTES] * 2, int(endpoint.rpartition(":")[2])  # of the client and of the hub
        async with asyncio.timeout(NOTICED_WITHIN_S):
            while unsent_limits(port) != both:
                await changes(bus, 2, within_s=0.1)
    finally:
        await bus.close()
        await hub.close()


async def test_a_link_to_a_hub_stays() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    bus = ZenohBus.open("another", CLIENT, clock, client_config(endpoint))
    try:
        assert await changes(bus, 2, within_s=0.5) == [True]
    finally:
        await bus.close()
        await hub.close()


async def test_a_link_with_a_long_round_trip_stays_after_some_attempts() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    delay_s = 1.5 * zenoh_links.ANSWER_WITHIN_S
    async with a_deaf_connection_first(int(endpoint.rpartition(":")[2]), delay_s) as (port, _):
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(f"tcp/127.0.0.1:{port}"))
        try:
            async with asyncio.timeout(NOTICED_WITHIN_S):
                while await changes(bus, 2, within_s=10 * delay_s) != [True]:
                    pass  # its round trip was taken for deafness
        finally:
            await bus.close()
    await hub.close()


async def test_a_component_of_the_same_host_answers_sooner_than_a_slow_hub_could(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A round trip of 0.4 s to the hub is 0.8 s between two of its clients: as long as an ARC waits for its RC."""
    monkeypatch.setattr(zenoh_links, "ANSWER_WITHIN_S", 2.0)
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    async with a_deaf_connection_first(int(endpoint.rpartition(":")[2]), delay_s=0.2) as (port, _):
        buses = []
        for source in (RC, "resource_pool/arc"):
            bus = await ZenohBus.open_when_up(MISSION, source, clock, client_config(f"tcp/127.0.0.1:{port}"))
            bus.use_host(str(tmp_path))
            buses.append(bus)
        rc, arc = buses
        rc.serve(RC, Echo, echo)
        try:
            for number in range(3):
                assert (await arc.ask(RC, Echo(str(number)), Echoed, within_s=RC_REPLY_S)).text == str(number)
        finally:
            for bus in buses:
                await bus.close()
    await hub.close()
