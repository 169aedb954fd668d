"""Strangers at the door of the web console keep no operator out, whatever they do there and however many they are."""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import ExitStack, asynccontextmanager

import pytest
import trustme
import uvloop
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.client import connect

from ui_console.web import porch, strangers
from ui_console.web.door import Doorkeeper, Hello, Offence, Pass, Welcome
from ui_console.web.outbox import Outbox
from ui_console.web.protocol import Intent, understand
from ui_console.web.reception import Reception, port_of
from ui_console.web.site import SOCKET_PATH, Site
from ui_console.web.strangers import MOST_OF_AN_ADDRESS, MOST_STRANGERS, Strangers

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


class Hall:
    """A house without a mission."""

    def __init__(self) -> None:
        self.guests: dict[Person, None] = {}
        self.offences: list[tuple[str, Offence]] = []

    def enter(self, welcome: Welcome) -> Person:
        person = Person(welcome)
        person.outbox.put_section("welcome", json.dumps(welcome.user).encode())
        self.guests[person] = None
        return person

    async def obey(self, guest: Person, intent: Intent) -> None:
        raise AssertionError(intent)

    def refused(self, guest: Person) -> None:
        raise AssertionError(guest)

    async def leave(self, guest: Person, reason: str) -> None:
        del self.guests[guest]

    def offended(self, who: str, offence: Offence) -> None:
        self.offences.append((who, offence))


class Door:
    """A reception that serves, and who comes to it."""

    def __init__(self, hall: Hall, port: int, client: ssl.SSLContext | None) -> None:
        self.hall, self.port, self.client = hall, port, client

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
        """Have many come who say this and nothing more, and read nothing."""
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
async def door(encryption: ssl.SSLContext | None, client: ssl.SSLContext | None) -> AsyncIterator[Door]:
    hall = Hall()
    read: Callable[[bytes | str], Hello | Intent] = understand
    reception: Reception[Person, Intent] = Reception(hall, Doorkeeper({TOKEN: Pass("", 1)}), Site(), read)
    async with reception.open("127.0.0.1", 0, encryption) as server:
        yield Door(hall, port_of(server), client)


def at_door(visit: Callable[[Door], Awaitable[None]], *, encrypted: bool, loop: str) -> None:
    """Let this visit happen at a door, in the loop of tests or of real servers."""
    server = client = None
    if encrypted:
        authority = trustme.CA()
        server, client = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH), ssl.create_default_context()
        authority.issue_cert("127.0.0.1").configure_cert(server)
        authority.configure_trust(client)

    async def main() -> None:
        async with door(server, client) as here:
            await visit(here)

    with asyncio.Runner(loop_factory=uvloop.new_event_loop if loop == "uvloop" else None) as runner:
        runner.run(main())


@pytest.mark.parametrize("loop", ["asyncio", "uvloop"])
@pytest.mark.parametrize("encrypted", [False, True])
@pytest.mark.parametrize("many", [16, 200])
@pytest.mark.parametrize("way", WAYS)
def test_an_operator_gets_in_whatever_strangers_do(way: str, many: int, encrypted: bool, loop: str) -> None:
    async def visit(here: Door) -> None:
        with ExitStack() as stack:
            await here.crowd(stack, many, WAYS[way])
            await here.load_page()
            await here.come_in()
            await here.crowd(stack, many, WAYS[way])
            await here.come_in()

    at_door(visit, encrypted=encrypted, loop=loop)


@pytest.mark.parametrize("encrypted", [False, True])
def test_an_operator_who_is_in_is_not_cut_off_for_newcomers(encrypted: bool) -> None:
    async def visit(here: Door) -> None:
        scheme = "wss" if encrypted else "ws"
        async with connect(f"{scheme}://127.0.0.1:{here.port}{SOCKET_PATH}", ssl=here.client, proxy=None) as me:
            await me.send(json.dumps({"do": "hello", "token": TOKEN, "user": "anna"}))
            assert "anna" in str(await me.recv())
            with ExitStack() as stack:
                await here.crowd(stack, 200, b"")
                await here.come_in()
                async with asyncio.timeout(WITHIN_S):
                    await (await me.ping())
                assert len(here.hall.guests) >= 1

    at_door(visit, encrypted=encrypted, loop="uvloop")


@pytest.mark.parametrize("loop", ["asyncio", "uvloop"])
@pytest.mark.parametrize("encrypted", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_strangers_are_gone_after_a_while(
    way: str, encrypted: bool, loop: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(porch, "STRANGER_WITHIN_S", 0.3)

    async def visit(here: Door) -> None:
        with ExitStack() as stack:
            running = asyncio.get_running_loop()
            for one in await here.crowd(stack, 3, WAYS[way]):
                async with asyncio.timeout(WITHIN_S):
                    try:
                        while await running.sock_recv(one, 1 << 16):
                            pass
                    except ConnectionError:
                        pass

    at_door(visit, encrypted=encrypted, loop=loop)


def test_a_crowd_is_told_once_with_its_address() -> None:
    async def visit(here: Door) -> None:
        with ExitStack() as stack:
            await here.crowd(stack, 200, b"")
            await here.come_in()
        [(who, offence)] = here.hall.offences
        assert who == "127.0.0.1"
        assert offence.fault == "crowd"

    at_door(visit, encrypted=False, loop="asyncio")


# ---------------------------------------------------------------------- who makes room
def test_of_an_address_the_oldest_silent_one_makes_room_before_any_that_asked() -> None:
    door_: Strangers[int] = Strangers()
    assert [door_.came(who, "a") for who in range(MOST_OF_AN_ADDRESS)] == [None] * MOST_OF_AN_ADDRESS
    door_.asked(0)
    assert door_.came(100, "a") == 1
    door_.gone(2)
    assert door_.came(101, "a") is None
    for who in range(3, 102):
        door_.asked(who)
    assert door_.came(102, "a") == 0, "all have asked: the oldest"


def test_many_from_few_addresses_keep_nobody_of_another_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strangers, "MOST_STRANGERS", 6)
    door_: Strangers[str] = Strangers()
    for number in range(4):
        door_.came(f"flood {number}", "flood")
    assert door_.came("anna", "lab") is None
    assert door_.came("ben", "home") is None
    assert door_.came("carla", "hall") == "flood 0"
    assert door_.came("flood 9", "flood") == "flood 1"


@given(st.lists(st.tuples(st.sampled_from(["came", "asked", "gone"]), st.integers(0, 400), st.integers(0, 4))))
def test_law_there_are_never_more_than_there_is_room_for(events: list[tuple[str, int, int]]) -> None:
    door_: Strangers[int] = Strangers()
    there: dict[int, int] = {}
    for what, who, address in events:
        if what == "came" and who not in there:
            displaced = door_.came(who, str(address))
            there[who] = address
            if displaced is not None:
                assert displaced != who
                del there[displaced]
        elif what == "asked" and who in there:
            door_.asked(who)
        elif what == "gone":
            door_.gone(who)
            there.pop(who, None)
        assert len(door_) == len(there) <= MOST_STRANGERS
        assert all(list(there.values()).count(address) <= MOST_OF_AN_ADDRESS for address in range(5))
