"""What the laws of all buses are written with: messages, listeners, and waiting."""

import asyncio
import itertools
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from backbone.bus.interface import Bus, Clock
from backbone.errors import Refusal
from backbone.wire import Envelope, Message

marks = itertools.count()
DEADLINE_S = 30.0  # of real or virtual time, for anything that must happen; a test fails with a message after it
ASK_S = 5.0
SERVER, ASKER, THIRD = "backbone/server", "ui_console/asker", "resource_pool/third"


class Echo(Message, frozen=True):
    text: str = ""


class Echoed(Message, frozen=True):
    text: str = ""


class Other(Message, frozen=True):
    """A message that no component of these tests accepts."""


class News(Message, frozen=True):
    number: int


class TooLoud(Refusal):
    code = "test.loud"
    remedy = "Whisper."


class Net:
    """Somewhere buses can be opened; closes those it opened."""

    def __init__(self, join: Callable[[str, Clock], Bus], clock: Clock) -> None:
        self._join, self.clock = join, clock
        self.buses: list[Bus] = []

    def join(self, source: str) -> Bus:
        bus = self._join(source, self.clock)
        bus.on_bug = fail_on_bug
        self.buses.append(bus)
        return bus

    async def close(self) -> None:
        for bus in self.buses:
            await bus.close()


Law = Callable[[Net], Awaitable[None]]
Runner = Callable[[Law], None]


def fail_on_bug(bug: BaseException) -> None:
    raise AssertionError("a bug nobody expected here") from bug


async def run_and_close(law: Law, net: Net) -> None:
    try:
        await within(law(net), "the whole test")
    finally:
        await net.close()


async def within(work: Awaitable[Any], what: str, limit_s: float = DEADLINE_S) -> Any:
    try:
        async with asyncio.timeout(limit_s):
            return await work
    except TimeoutError:
        pytest.fail(f"not within {limit_s:g} s: {what}")


async def until_known(declared_on: Bus, to: Bus) -> None:
    """Return when what was declared on one bus so far is known on the other: a token declared last says so."""
    risen = asyncio.Event()
    address = f"{declared_on.source}-mark-{next(marks)}"
    token = declared_on.declare_alive(address)
    watching = to.watch_alive(address, lambda _address, alive: risen.set() if alive else None)
    await within(risen.wait(), f"{to.source} hears of {declared_on.source}")
    watching.close()
    token.close()


@asynccontextmanager
async def pair(net: Net, answer: Callable[[Envelope[Any]], Awaitable[Message]], accepts: Any = Echo) -> Any:
    """Give an asker and a server that answers at ``SERVER``."""
    server, asker = net.join(SERVER), net.join(ASKER)
    server.serve(SERVER, accepts, answer)
    await until_known(server, asker)
    yield asker, server


async def echo(asked: Envelope[Any]) -> Message:
    return Echoed(asked.body.text)


class Heard:
    """A listener that can be waited on."""

    def __init__(self) -> None:
        self.all: list[Any] = []
        self._more = asyncio.Event()

    def __call__(self, *what: Any) -> None:
        self.all.append(what[0] if len(what) == 1 else what)
        self._more.set()

    async def until(self, holds: Callable[[list[Any]], bool], what: str) -> list[Any]:
        async def wait() -> None:
            while not holds(self.all):
                self._more.clear()
                await self._more.wait()

        await within(wait(), f"{what}; heard {self.all!r}")
        return self.all

    async def until_count(self, count: int) -> list[Any]:
        return await self.until(lambda heard: len(heard) >= count, f"{count} heard")

    def numbers(self) -> list[int]:
        return [envelope.body.number for envelope in self.all]
