"""Clients without a token keep no operator of the web console out, in any number and at any step."""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import ExitStack, asynccontextmanager
from functools import cache
from itertools import product

import pytest
import trustme
import uvloop
from examples import some
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.client import connect

from ui_console.web import pending_clients, pending_connections
from ui_console.web.login import Authenticator, Hello, ProtocolViolation, TokenRights, Welcome
from ui_console.web.outbox import Outbox
from ui_console.web.page_files import SOCKET_PATH, PageFiles
from ui_console.web.page_server import PageServer, port_of
from ui_console.web.pending_clients import MOST_OF_AN_ADDRESS, MOST_PENDING, PendingClients
from ui_console.web.protocol import Intent, understand

TOKEN = "right"  # noqa: S105  of this test
WITHIN_S = 5.0
UPGRADE = (
    f"GET {SOCKET_PATH} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
).encode()
WAYS = {
    "say nothing": b"",
    "begin to encrypt": b"\x16\x03\x01\x02",
    "ask half": UPGRADE[:40],
    "ask and show no token": UPGRADE,
    "do not read the page": b"GET /main.js HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
}


class Person:
    def __init__(self, welcome: Welcome) -> None:
        self.welcome, self.outbox, self.news = welcome, Outbox(), asyncio.Event()


class Receiver:
    """An application without a mission."""

    def __init__(self) -> None:
        self.clients: dict[Person, None] = {}
        self.violations: list[tuple[str, ProtocolViolation]] = []

    def enter(self, welcome: Welcome) -> Person:
        person = Person(welcome)
        person.outbox.put_section("welcome", json.dumps(welcome.user).encode())
        self.clients[person] = None
        return person

    async def obey(self, client: Person, intent: Intent) -> None:
        raise AssertionError(intent)

    def refused(self, client: Person) -> None:
        raise AssertionError(client)

    async def leave(self, client: Person, reason: str) -> None:
        del self.clients[client]

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        self.violations.append((who, violation))


class Served:
    """A page server, and the clients that connect to it."""

    def __init__(self, application: Receiver, port: int, client: ssl.SSLContext | None) -> None:
        self.application, self.port, self.client = application, port, client

    async def come_in(self) -> None:
        """Be welcomed with the right token, and leave."""
        scheme = "ws" if self.client is None else "wss"
        async with (
            asyncio.timeout(WITHIN_S),
            connect(
                f"{scheme}://127.0.0.1:{self.port}{SOCKET_PATH}", ssl=self.client, compression=None, proxy=None
            ) as me,
        ):
            await me.send(json.dumps({"do": "hello", "token": TOKEN, "user": "anna"}))
            assert "anna" in str(await me.recv())

    async def load_page(self) -> None:
        async with asyncio.timeout(WITHIN_S):
            reader, writer = await asyncio.open_connection("127.0.0.1", self.port, ssl=self.client)
            writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert b"<html" in await reader.read()
            writer.close()

    async def crowd(self, stack: ExitStack, many: int, says: bytes) -> list[socket.socket]:
        """Connect many clients that send this and nothing more, and read nothing."""
        came = []
        for _ in range(many):
            one = stack.enter_context(socket.socket())
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
            one.setblocking(False)
            await asyncio.get_running_loop().sock_connect(one, ("127.0.0.1", self.port))
            one.sendall(says)
            came.append(one)
        return came


@asynccontextmanager
async def served(encryption: ssl.SSLContext | None, client: ssl.SSLContext | None) -> AsyncIterator[Served]:
    application = Receiver()
    read: Callable[[bytes | str], Hello | Intent] = understand
    page_server: PageServer[Person, Intent] = PageServer(
        application, Authenticator({TOKEN: TokenRights("", 1)}), PageFiles(), read
    )
    async with page_server.open("127.0.0.1", 0, encryption) as server:
        yield Served(application, port_of(server), client)


@cache
def papers() -> tuple[ssl.SSLContext, ssl.SSLContext]:
    """Return the contexts of a server and of its clients."""
    authority = trustme.CA()
    server, client = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH), ssl.create_default_context()
    authority.issue_cert("127.0.0.1").configure_cert(server)
    authority.configure_trust(client)
    return server, client


def at_server(visit: Callable[[Served], Awaitable[None]], *, encrypted: bool, loop: str) -> None:
    """Run this visit at a server, in the loop of tests or of real servers."""
    server, client = papers() if encrypted else (None, None)

    async def main() -> None:
        async with served(server, client) as here:
            await visit(here)

    with asyncio.Runner(loop_factory=uvloop.new_event_loop if loop == "uvloop" else None) as runner:
        runner.run(main())


@pytest.mark.parametrize(
    ("way", "many", "encrypted", "loop"), some(product(WAYS, [16, 200], [False, True], ["asyncio", "uvloop"]))
)
def test_an_operator_gets_in_whatever_strangers_do(way: str, many: int, encrypted: bool, loop: str) -> None:
    async def visit(here: Served) -> None:
        with ExitStack() as stack:
            await here.crowd(stack, many, WAYS[way])
            await here.load_page()
            await here.come_in()
            await here.crowd(stack, many, WAYS[way])
            await here.come_in()

    at_server(visit, encrypted=encrypted, loop=loop)


@pytest.mark.parametrize("encrypted", [False, True])
def test_an_operator_who_is_in_is_not_cut_off_for_newcomers(encrypted: bool) -> None:
    async def visit(here: Served) -> None:
        scheme = "wss" if encrypted else "ws"
        async with connect(f"{scheme}://127.0.0.1:{here.port}{SOCKET_PATH}", ssl=here.client, proxy=None) as me:
            await me.send(json.dumps({"do": "hello", "token": TOKEN, "user": "anna"}))
            assert "anna" in str(await me.recv())
            with ExitStack() as stack:
                await here.crowd(stack, 200, b"")
                await here.come_in()
                async with asyncio.timeout(WITHIN_S):
                    await (await me.ping())
                assert len(here.application.clients) >= 1

    at_server(visit, encrypted=encrypted, loop="uvloop")


@pytest.mark.parametrize("loop", ["asyncio", "uvloop"])
@pytest.mark.parametrize("encrypted", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_strangers_are_gone_after_a_while(
    way: str, encrypted: bool, loop: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pending_connections, "AUTHENTICATED_WITHIN_S", 0.3)

    async def visit(here: Served) -> None:
        with ExitStack() as stack:
            running = asyncio.get_running_loop()
            for one in await here.crowd(stack, 3, WAYS[way]):
                async with asyncio.timeout(WITHIN_S):
                    try:
                        while await running.sock_recv(one, 1 << 16):
                            pass
                    except ConnectionError:
                        pass

    at_server(visit, encrypted=encrypted, loop=loop)


def test_a_crowd_is_told_once_with_its_address() -> None:
    async def visit(here: Served) -> None:
        with ExitStack() as stack:
            await here.crowd(stack, 200, b"")
            await here.come_in()
        [(who, violation)] = here.application.violations
        assert who == "127.0.0.1"
        assert violation.kind == "crowd"

    at_server(visit, encrypted=False, loop="asyncio")


def test_of_an_address_the_oldest_silent_one_makes_room_before_any_that_asked() -> None:
    pending: PendingClients[int] = PendingClients()
    assert [pending.came(who, "a") for who in range(MOST_OF_AN_ADDRESS)] == [None] * MOST_OF_AN_ADDRESS
    pending.asked(0)
    assert pending.came(100, "a") == 1
    pending.gone(2)
    assert pending.came(101, "a") is None
    for who in range(3, 102):
        pending.asked(who)
    assert pending.came(102, "a") == 0, "all have asked: the oldest"


def test_many_from_few_addresses_keep_nobody_of_another_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pending_clients, "MOST_PENDING", 6)
    pending: PendingClients[str] = PendingClients()
    for number in range(4):
        pending.came(f"flood {number}", "flood")
    assert pending.came("anna", "lab") is None
    assert pending.came("ben", "home") is None
    assert pending.came("carla", "hall") == "flood 0"
    assert pending.came("flood 9", "flood") == "flood 1"


@given(st.lists(st.tuples(st.sampled_from(["came", "asked", "gone"]), st.integers(0, 400), st.integers(0, 4))))
def test_law_there_are_never_more_than_there_is_room_for(events: list[tuple[str, int, int]]) -> None:
    pending: PendingClients[int] = PendingClients()
    there: dict[int, int] = {}
    for what, who, address in events:
        if what == "came" and who not in there:
            displaced = pending.came(who, str(address))
            there[who] = address
            if displaced is not None:
                assert displaced != who
                del there[displaced]
        elif what == "asked" and who in there:
            pending.asked(who)
        elif what == "gone":
            pending.gone(who)
            there.pop(who, None)
        assert len(pending) == len(there) <= MOST_PENDING
        assert all(list(there.values()).count(address) <= MOST_OF_AN_ADDRESS for address in range(5))
