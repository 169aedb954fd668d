"""What only the bus between processes has to stand: bytes of any kind, and a hub that comes and goes."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager
from typing import Any

import pytest
import zenoh
from free_ports import free_endpoint
from hostile_messages import enveloped, honest, hostile_messages

from backbone.bus import zenoh_bus, zenoh_settings
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.bus.zenoh_outlets import MOST_PUBLISHERS
from backbone.component.messages import AskState, CommonQuestion, SetParameter, Stop, Stopping
from backbone.errors import HubUnreachable, NoResponder
from backbone.keys import Conversation, key
from backbone.wire import MAX_MESSAGE_BYTES, Envelope, MalformedMessage, Message, OversizedMessage, Reader, Refused

DEADLINE_S = 10.0
SERVER, ASKER = "backbone/server", "ui_console/asker"
CLOCK = MissionClock.started_now()


class Letter(Message, frozen=True):
    """A message of any length."""

    text: str


async def within(work: Awaitable[Any], what: str, limit_s: float = DEADLINE_S) -> Any:
    try:
        async with asyncio.timeout(limit_s):
            return await work
    except TimeoutError:
        pytest.fail(f"not within {limit_s:g} s: {what}")


def join(endpoint: str, source: str) -> ZenohBus:
    return ZenohBus.open("hostile", source, CLOCK, client_config(endpoint))


def open_hub(endpoint: str) -> ZenohBus:
    return ZenohBus.open("hostile", "backbone/hub", CLOCK, hub_config([endpoint]))


@asynccontextmanager
async def hub_at(endpoint: str) -> AsyncIterator[ZenohBus]:
    hub = open_hub(endpoint)
    try:
        yield hub
    finally:
        await hub.close()


@asynccontextmanager
async def joined(endpoint: str, *sources: str) -> AsyncIterator[list[ZenohBus]]:
    buses = [join(endpoint, source) for source in sources]
    try:
        yield buses
    finally:
        for bus in buses:
            await bus.close()


async def until_alive(bus: ZenohBus, address: str, alive: bool = True) -> None:
    seen = asyncio.Event()
    watching = bus.watch_alive(address, lambda _address, now: seen.set() if now is alive else None)
    await within(seen.wait(), f"{bus.source} sees {address} {'alive' if alive else 'fall'}")
    watching.close()


@asynccontextmanager
async def raw_session(endpoint: str) -> AsyncIterator[zenoh.Session]:
    session = await asyncio.to_thread(zenoh.open, client_config(endpoint))
    try:
        yield session
    finally:
        await asyncio.to_thread(session.close)


async def ask_raw(session: zenoh.Session, payload: bytes | None) -> list[zenoh.Reply]:
    asked = key("hostile", SERVER, Conversation.ASK)
    return await asyncio.to_thread(lambda: list(session.get(asked, payload=payload, timeout=DEADLINE_S)))


async def test_each_hostile_message_gets_a_typed_refusal_and_changes_nothing() -> None:
    called: list[Message] = []
    bugs: list[BaseException] = []

    async def answer(asked: Envelope[Any]) -> Message:
        called.append(asked.body)
        return Stopping()

    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, SERVER, ASKER) as (server, asker), raw_session(endpoint) as raw:
        server.on_bug = bugs.append
        server.serve(SERVER, CommonQuestion, answer)
        server.declare_alive(SERVER)
        await until_alive(asker, SERVER)
        hostile = list(hostile_messages())
        for bad in hostile:
            (reply,) = await ask_raw(raw, bad.payload)
            assert reply.err is not None, bad.name
            refusal = Reader(Refused).read(reply.err.payload.to_bytes()).body.revive()
            assert type(refusal) is bad.refusal, bad.name
        (reply,) = await ask_raw(raw, None)
        assert reply.err is not None
        assert (called, bugs) == ([], [])
        assert server.statistics().unreadable == len(hostile) + 1
        assert await asker.ask(SERVER, Stop(), Stopping, within_s=DEADLINE_S) == Stopping()


@pytest.mark.parametrize("bad", [b"", b"\xc1garbage", b"\x91" * 100_000, enveloped(None), honest(AskState())])
@pytest.mark.parametrize("as_error", [False, True])
async def test_a_reply_that_cannot_be_read_is_malformed(bad: bytes, as_error: bool) -> None:
    def reply(query: zenoh.Query) -> None:
        with query:
            if as_error:
                query.reply_err(bad)
            else:
                query.reply(query.key_expr, bad)

    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, ASKER) as (asker,), raw_session(endpoint) as raw:
        raw.declare_queryable(key("hostile", SERVER, Conversation.ASK), reply)
        token = raw.liveliness().declare_token(key("hostile", SERVER, Conversation.ALIVE))
        await until_alive(asker, SERVER)
        with pytest.raises(MalformedMessage, match=SERVER):
            await asker.ask(SERVER, AskState(), Stopping, within_s=DEADLINE_S)
        assert asker.statistics().unreadable == 1
        token.undeclare()


async def test_hostile_publications_are_counted_and_skipped(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.ERROR)
    heard = asyncio.Event()
    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, SERVER, ASKER) as (server, asker), raw_session(endpoint) as raw:
        server.subscribe(ASKER, Conversation.COMMAND, Stop, lambda _stop: heard.set())
        server.declare_alive(SERVER)
        await until_alive(asker, SERVER)
        hostile = list(hostile_messages())
        own = key("hostile", ASKER, Conversation.COMMAND)
        for bad in hostile:
            raw.put(own, bad.payload, congestion_control=zenoh.CongestionControl.BLOCK)
        raw.put(own, honest(Stop()), congestion_control=zenoh.CongestionControl.BLOCK)
        await within(heard.wait(), "the honest publication after the bad ones")
        assert server.statistics().unreadable == len(hostile)


async def test_an_answer_that_is_too_long_becomes_a_refusal() -> None:
    async def answer(asked: Envelope[Any]) -> Message:
        return Stop("x" * MAX_MESSAGE_BYTES)

    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, SERVER) as (bus,):
        bus.serve(SERVER, AskState, answer)
        with pytest.raises(OversizedMessage):
            await bus.ask(SERVER, AskState(), Stop, within_s=DEADLINE_S)


async def test_a_question_that_is_too_long_is_not_sent() -> None:
    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, ASKER) as (asker,):
        with pytest.raises(OversizedMessage):
            await asker.ask(SERVER, Stop("x" * MAX_MESSAGE_BYTES), Stopping, within_s=DEADLINE_S)


async def test_an_answer_that_cannot_be_written_is_a_bug_of_the_answerer() -> None:
    async def answer(asked: Envelope[Any]) -> Message:
        return SetParameter("speed", object())

    bugs: list[BaseException] = []
    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, SERVER) as (bus,):
        bus.on_bug = bugs.append
        bus.serve(SERVER, AskState, answer)
        with pytest.raises(NoResponder):
            await bus.ask(SERVER, AskState(), SetParameter, within_s=DEADLINE_S)
        assert [type(bug) for bug in bugs] == [TypeError]


async def test_a_large_message_passes_whole() -> None:
    async def answer(asked: Envelope[Any]) -> Message:
        return Letter(asked.body.text[::-1])

    endpoint = free_endpoint()
    text = "0123456789" * 700_000
    async with hub_at(endpoint), joined(endpoint, SERVER, ASKER) as (server, asker):
        server.serve(SERVER, Letter, answer)
        server.declare_alive(SERVER)
        await until_alive(asker, SERVER)
        assert (await asker.ask(SERVER, Letter(text), Letter, within_s=DEADLINE_S)).text == text[::-1]


async def test_a_hub_that_dies_and_returns_is_noticed_and_everything_declared_stands_again() -> None:
    async def answer(asked: Envelope[Any]) -> Message:
        return Stopping()

    endpoint = free_endpoint()
    links: asyncio.Queue[bool] = asyncio.Queue()
    hub = open_hub(endpoint)
    async with joined(endpoint, SERVER, ASKER) as (server, asker):
        server.serve(SERVER, AskState, answer)
        server.declare_alive(SERVER)
        await until_alive(asker, SERVER)
        asker.watch_link(links.put_nowait)
        assert await within(links.get(), "the link is up") is True
        await hub.close()
        assert await within(links.get(), "the link falls") is False
        with pytest.raises(NoResponder):
            await asker.ask(SERVER, AskState(), Stopping, within_s=DEADLINE_S)
        async with hub_at(endpoint):
            assert await within(links.get(), "the link comes back") is True
            await until_alive(asker, SERVER)
            assert await asker.ask(SERVER, AskState(), Stopping, within_s=DEADLINE_S) == Stopping()


async def test_a_hub_sees_its_own_link_up_whoever_comes_and_goes() -> None:
    endpoint = free_endpoint()
    links: list[bool] = []
    async with hub_at(endpoint) as hub:
        hub.watch_link(links.append)
        async with joined(endpoint, SERVER) as (server,):
            server.declare_alive(SERVER)
            await until_alive(hub, SERVER)
        await until_gone(hub)
        assert links == [True]


async def until_gone(hub: ZenohBus) -> None:
    """Return when a token declared and withdrawn by a last client has fallen: earlier falls were reported too."""
    fallen = asyncio.Event()
    watching = hub.watch_alive(SERVER, lambda _address, alive: None if alive else fallen.set())
    other = hub.declare_alive(SERVER)
    other.close()
    await within(fallen.wait(), "the token falls")
    watching.close()


async def test_a_hub_on_a_taken_port_is_unreachable() -> None:
    endpoint = free_endpoint()
    async with hub_at(endpoint):
        with pytest.raises(HubUnreachable):
            open_hub(endpoint)


async def test_no_hub_is_unreachable_when_the_time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zenoh_settings, "OPEN_TIMEOUT_MS", 100)
    config = client_config(free_endpoint())
    with pytest.raises(HubUnreachable):
        ZenohBus.open("hostile", ASKER, CLOCK, config)
    with pytest.raises(HubUnreachable):
        await ZenohBus.open_when_up("hostile", ASKER, CLOCK, config)


async def test_a_bus_opens_as_soon_as_the_hub_is_up_and_the_loop_goes_on_meanwhile() -> None:
    endpoint = free_endpoint()
    opening = asyncio.create_task(ZenohBus.open_when_up("hostile", ASKER, CLOCK, client_config(endpoint)))
    await asyncio.sleep(0)
    async with hub_at(endpoint):
        bus = await within(opening, "the bus opens")
        await bus.close()


async def test_an_opening_that_is_cancelled_closes_its_session() -> None:
    endpoint = free_endpoint()
    gone = threading.Event()
    opening = asyncio.create_task(ZenohBus.open_when_up("hostile", ASKER, CLOCK, client_config(endpoint)))
    await asyncio.sleep(0)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    hub = await asyncio.to_thread(zenoh.open, hub_config([endpoint]))
    try:
        for thread in threading.enumerate():
            if thread.name.startswith("zenoh_open"):
                await asyncio.to_thread(thread.join, DEADLINE_S)
                assert not thread.is_alive(), "the session still did not open"
        hub.info.declare_transport_events_listener(
            lambda event: gone.set() if event.kind == zenoh.SampleKind.DELETE else None, history=False
        )
        if list(hub.info.transports()):
            assert await asyncio.to_thread(gone.wait, DEADLINE_S), "the session that opened after all was not closed"
    finally:
        await asyncio.to_thread(hub.close)


class CountedSession:
    """A session that counts the publishers that stand."""

    def __init__(self, session: zenoh.Session) -> None:
        self._of = session
        self.standing = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)

    def declare_publisher(self, at: str, **how: Any) -> CountedPublisher:
        self.standing += 1
        return CountedPublisher(self, self._of.declare_publisher(at, **how))


class CountedPublisher:
    def __init__(self, session: CountedSession, publisher: zenoh.Publisher) -> None:
        self._session, self._of = session, publisher

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, name)

    def put(self, payload: bytes) -> None:
        self._of.put(payload)

    def undeclare(self) -> None:
        self._session.standing -= 1
        self._of.undeclare()


async def test_who_publishes_under_ever_new_addresses_does_not_grow() -> None:
    """As a framegrabber does for each ARC that holds it: every visit of a console has one of its own."""
    endpoint = free_endpoint()
    async with hub_at(endpoint), joined(endpoint, ASKER) as [listener]:
        heard: list[str] = []
        listener.subscribe("resource_pool/*", Conversation.FRAMES, Stop, lambda one: heard.append(one.body.reason))
        session = CountedSession(zenoh_bus.open_session(client_config(endpoint)))
        bus = ZenohBus("hostile", SERVER, CLOCK, session)  # type: ignore[arg-type]
        try:
            for number in [*range(300), 0]:
                bus.publish(f"resource_pool/arc-{number}", Conversation.FRAMES, Stop(str(number)))
            assert session.standing == MOST_PUBLISHERS + 1, "and that of copies"
            async with asyncio.timeout(DEADLINE_S):
                while len(heard) < 301:
                    bus.publish("resource_pool/arc-0", Conversation.FRAMES, Stop("again"))
                    await CLOCK.sleep_s(0.05)
            assert heard[:301] == [*map(str, range(300)), "0"]
        finally:
            await bus.close()
