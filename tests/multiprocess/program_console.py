"""A program that speaks to the web console of a mission, as a page does."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from served_page import Served
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

WITHIN_S = 30.0


async def wait_until(is_so: Callable[[], Awaitable[bool]], what: str, within_s: float = WITHIN_S) -> None:
    try:
        async with asyncio.timeout(within_s):
            while not await is_so():  # noqa: ASYNC110  what another process does gives no event here
                await asyncio.sleep(0.1)
    except TimeoutError:
        pytest.fail(f"never: {what}")


class Program:
    """What a page does, as a program."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.view: dict[str, Any] = {}
        self.pictures = 0

    async def say(self, **message: Any) -> None:
        await self.socket.send(json.dumps(message))

    async def listen(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in self.socket:
                if isinstance(message, bytes):
                    self.pictures += 1
                    number = int.from_bytes(message[7:11], "big")
                    await self.say(do="drawn", robot="scout1", number=number)
                else:
                    self.view.update(json.loads(message).get("view", {}))

    async def drive(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                moment = self.view["own"]["moment"]
                await self.say(do="drive", moment=moment, forward=0, right=1, speed=0.4)
                await asyncio.sleep(0.05)

    async def wait(self, is_so: Callable[[], Any], what: str, within_s: float = WITHIN_S) -> None:
        async def asked() -> bool:
            return bool(is_so())

        await wait_until(asked, f"{what}: {self.view.get('own')}", within_s)

    @property
    def is_held(self) -> bool:
        return bool(self.view["own"]["is_held"])


@asynccontextmanager
async def program(served: Served, user: str, priority: int = 100) -> AsyncIterator[Program]:
    async with connect(f"ws://127.0.0.1:{served.port}/socket", compression=None, proxy=None) as socket:
        made = Program(socket)
        await made.say(do="hello", token=served.token, user=user, priority=priority)
        listening = asyncio.create_task(made.listen())
        try:
            await made.wait(lambda: made.view.get("robots"), "robots")
            yield made
        finally:
            listening.cancel()
            await asyncio.wait({listening})
