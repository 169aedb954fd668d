"""A designer's server on the loopback, and pages of it without a browser."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from backbone.mission.class_facts import ClassFacts
from ui_console.design.room import DesignRoom
from ui_console.design.server import DesignServer, begin
from ui_console.web.login import Authenticator, TokenRights

MISSION_XML = (Path(__file__).parents[3] / "mission.xml").read_bytes()
ANNA, BEN = "token-of-anna", "token-of-ben"
RIGHTS = {ANNA: TokenRights("anna", 100), BEN: TokenRights("ben", 50)}
WITHIN_S = 15.0


class Page:
    """What a page hears, without a page."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.view: dict[str, Any] = {}
        self.answers: list[dict[str, Any]] = []
        self.news = asyncio.Event()

    async def listen(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in self.socket:
                said = json.loads(message)
                self.view.update(said.get("view", {}))
                self.answers += [said["answer"]] if "answer" in said else []
                self.news.set()
        self.news.set()

    async def say(self, **message: Any) -> None:
        await self.socket.send(json.dumps(message))

    async def change(self, **message: Any) -> dict[str, Any] | None:
        """Send a change of the present draft; return the answer once it was handled, None if there was none."""
        handled, heard = self.view.get("handled", 0), len(self.answers)
        await self.say(revision=self.view["status"]["revision"], **message)
        await self.wait(lambda: self.view.get("handled", 0) > handled, f"handled {message}")
        return self.answers[heard] if len(self.answers) > heard else None

    async def wait(self, holds: Callable[[], Any], what: str) -> None:
        try:
            async with asyncio.timeout(WITHIN_S):
                while not holds():
                    self.news.clear()
                    await self.news.wait()
        except TimeoutError:
            pytest.fail(f"never: {what}; status: {self.view.get('status')}; answers: {self.answers}")

    def has_element(self, words: str) -> bool:
        return any(words in f"{row['tag']} {row['told']}" for row in self.view.get("tree", []))

    def path(self, words: str) -> list[int]:
        return next(row["path"] for row in self.view["tree"] if words in f"{row['tag']} {row['told']}")


class Serving:
    """A designer's server."""

    def __init__(self, room: DesignRoom) -> None:
        self.room, self.port = room, 0
        self.end = asyncio.Event()
        self.asked: list[str] = []

    def connection(self, **options: Any) -> connect:
        return connect(f"ws://127.0.0.1:{self.port}/socket", compression=None, proxy=None, **options)

    @asynccontextmanager
    async def page(self, token: str = ANNA) -> AsyncIterator[Page]:
        async with self.connection() as socket:
            page = Page(socket)
            await page.say(do="hello", token=token)
            listening = asyncio.create_task(page.listen())
            try:
                await page.wait(lambda: "status" in page.view and "element" in page.view, "welcome")
                yield page
            finally:
                listening.cancel()
                await asyncio.wait({listening})


@asynccontextmanager
async def serving(file: Path) -> AsyncIterator[Serving]:
    draft, kept = begin(str(file))
    asked: list[str] = []

    async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
        asked.extend(class_paths)
        return {path: ClassFacts(f"About {path}.") for path in class_paths}

    made = Serving(DesignRoom(draft, kept, look_up))
    made.asked = asked
    ready = asyncio.Event()

    def listens(port: int) -> None:
        made.port = port
        ready.set()

    server = DesignServer(made.room, Authenticator(RIGHTS))
    life = asyncio.create_task(server.run("127.0.0.1", 0, listens, made.end))
    await ready.wait()
    try:
        yield made
    finally:
        made.end.set()
        await life
