"""A link over TCP that passes no messages is replaced; one that passes them stays."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import zenoh
from bus_laws import Echo, Echoed
from free_ports import free_endpoint
from relay import SHORTEST_PICTURE, relay_to
from test_zenoh_questions import echo

from backbone.authentication import SOCKET
from backbone.bus import zenoh_links
from backbone.bus.clock import MissionClock
from backbone.bus.shared_bus import SharedSession
from backbone.bus.sockets import MOST_UNSENT_BYTES
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.bus.zenoh_life import LifeBus
from backbone.errors import LinkError
from backbone.keys import KEY_OF_HUB, Conversation

MISSION, CLIENT, RC = "links", "ui_console/client", "resource_pool/rc"
RC_REPLY_S = 0.8  # as long as an ARC waits for its RC (resource_pool/arc_slice.py)
NOTICED_WITHIN_S = 10.0
HANDSHAKE_S = 0.3


@pytest.fixture(autouse=True)
def quick_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_links, "LOOK_EACH_S", 0.05)
    monkeypatch.setattr(zenoh_links, "ANSWER_WITHIN_S", 0.1)
    monkeypatch.setattr(zenoh_links, "HOST_LEASE_MS", 100)


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


async def is_echoed(asker: ZenohBus) -> bool:
    try:
        return (await asker.ask(RC, Echo("x"), Echoed, within_s=RC_REPLY_S)).text == "x"
    except LinkError:
        return False


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("is_inside", [False, True], ids=["tcp", "unix"])
async def test_a_link_without_messages_is_replaced_until_messages_pass(
    shared: bool, is_inside: bool, tmp_path: Path
) -> None:
    endpoint = f"{SOCKET}{tmp_path}/hub" if is_inside else free_endpoint()
    clock = MissionClock.started_now()
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


async def test_a_link_that_only_keeps_itself_alive_is_replaced() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    async with relay_to(endpoint) as relay:
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(relay.endpoint))
        relay.is_deaf.set()
        try:
            assert await changes(bus, 3) == [True, False, True]
            assert await changes(bus, 2, within_s=0.5) == [True]
        finally:
            await bus.close()
    await hub.close()


@pytest.mark.parametrize("late_s", [0.0, 3.0], ids=["at once", "when the lost one has ended"])
async def test_a_second_link_that_continues_a_lost_one_is_replaced(
    late_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The handshake's time ends while a link is reported, so zenoh makes another one; then the hub loses the first."""
    endpoint, clock, loop = free_endpoint(), MissionClock.started_now(), asyncio.get_running_loop()

    def call_later(_links: object, act: Callable[..., None], *arguments: object) -> None:
        loop.call_soon_threadsafe(loop.call_later, late_s, act, *arguments)

    monkeypatch.setattr(zenoh_links, "LOOK_EACH_S", 2 * NOTICED_WITHIN_S)
    monkeypatch.setattr(zenoh_links.Links, "_call_soon", call_later)
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    asker = ZenohBus.open(MISSION, CLIENT, clock, client_config(endpoint))
    async with relay_to(endpoint) as relay:
        config = client_config(relay.endpoint)
        config.insert_json5("transport/unicast/open_timeout", str(int(1000 * HANDSHAKE_S)))
        session = await asyncio.to_thread(zenoh.open, config)
        rc = ZenohBus(MISSION, RC, clock, session)
        rc.serve(RC, Echo, echo)
        links = list[str]()

        def reported(event: zenoh.LinkEvent) -> None:
            if event.kind == zenoh.SampleKind.PUT:
                links.append(event.link.src)
                if len(links) == 2:
                    loop.call_soon_threadsafe(relay.cut_at_hub)
                    time.sleep(2 * HANDSHAKE_S)
                elif len(links) == 3:
                    loop.call_soon_threadsafe(relay.let_go)

        session.info.declare_link_events_listener(zenoh.handlers.Callback(reported, indirect=False), history=True)
        try:
            relay.cut()
            async with asyncio.timeout(NOTICED_WITHIN_S):
                while len(links) < 3 or not await is_echoed(asker):
                    await changes(rc, 99, within_s=0.1)
        finally:
            for bus in (rc, asker, hub):
                await bus.close()


async def test_a_session_whose_sender_gave_its_link_up_has_one_link_afterwards() -> None:
    """A receiver that hangs ends it, and zenoh reports no end of the link."""
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    hub.subscribe(RC, Conversation.EVENTS, Echo, lambda _event: None)
    async with relay_to(endpoint) as relay:
        bus = await ZenohBus.open_when_up(MISSION, RC, clock, client_config(relay.endpoint))
        try:
            assert await changes(bus, 1) == [True]
            relay.reads.clear()
            seen: list[bool] = []
            bus.watch_link(seen.append)
            while False not in seen:
                bus.publish(RC, Conversation.EVENTS, Echo("x" * 1_000_000))  # blocks until it gives the link up
                await asyncio.sleep(0)
            relay.reads.set()
            async with asyncio.timeout(NOTICED_WITHIN_S):
                while (await changes(bus, 9, within_s=1.0)) != [True]:
                    pass
        finally:
            await bus.close()
    await hub.close()


async def test_an_attempt_to_connect_never_blocks_when_it_is_given_up() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    port = int(endpoint.rpartition(":")[2])
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    bus = ZenohBus.open(MISSION, CLIENT, clock, client_config(endpoint))
    assert await changes(bus, 1) == [True]
    await hub.close()
    try:
        with socket.create_server(("127.0.0.1", port)):  # answers nothing
            async with asyncio.timeout(NOTICED_WITHIN_S):
                while option_of_sockets(port, socket.SOL_SOCKET, socket.SO_LINGER) != [0]:
                    await changes(bus, 1, within_s=0.01)
    finally:
        await bus.close()


async def test_a_link_over_which_pictures_come_stays_although_answers_are_late(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_links, "ANSWER_WITHIN_S", 0.4)
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))

    async def send_pictures() -> None:
        while True:
            hub.publish(RC, Conversation.FRAMES, Echo("x" * 2 * SHORTEST_PICTURE))
            await asyncio.sleep(0.01)

    async with relay_to(endpoint) as relay:
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(relay.endpoint))
        relay.is_deaf.set()
        bus.subscribe(RC, Conversation.FRAMES, Echo, lambda _picture: None)
        sending = asyncio.create_task(send_pictures())
        try:
            assert await changes(bus, 2, within_s=3.0) == [True]  # without pictures it is replaced after 1 s
        finally:
            sending.cancel()
            await bus.close()
    await hub.close()


def option_of_sockets(port: int, level: int, option: int) -> list[int]:
    """Return an option of each end of the connections to a port."""
    values = []
    for entry in filter(Path.is_socket, Path("/proc/self/fd").iterdir()):
        with suppress(OSError), socket.fromfd(int(entry.name), socket.AF_INET, socket.SOCK_STREAM) as one:
            if (port,) in (one.getsockname()[1:], one.getpeername()[1:]):
                values.append(one.getsockopt(level, option))
    return values


async def test_of_a_link_the_system_keeps_few_bytes_that_no_urgent_message_overtakes() -> None:
    endpoint, clock = free_endpoint(), MissionClock.started_now()
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    bus = ZenohBus.open(MISSION, CLIENT, clock, client_config(endpoint))
    try:
        assert await changes(bus, 1) == [True]
        both, port = [MOST_UNSENT_BYTES] * 2, int(endpoint.rpartition(":")[2])  # of the client and of the hub
        async with asyncio.timeout(NOTICED_WITHIN_S):
            while option_of_sockets(port, socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT) != both:
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
    async with relay_to(endpoint, delay_s) as relay:
        bus = await ZenohBus.open_when_up(MISSION, CLIENT, clock, client_config(relay.endpoint))
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
    async with relay_to(endpoint, delay_s=0.2) as relay:
        buses = []
        for source in (RC, "resource_pool/arc"):
            bus = await ZenohBus.open_when_up(MISSION, source, clock, client_config(relay.endpoint))
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
