"""A page that was open before another server came up at its address."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

import pytest
import web_browser
from small_recordings import SCOUT, Said, recorded

from backbone.bus.clock import MissionClock
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from ui_console.web.login import Authenticator, TokenRights
from ui_console.web.page_files import PageFiles
from ui_console.web.page_server import PageServer, port_of
from ui_console.web.playing import understand
from ui_console.web.recording_room import RecordingRoom

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


@asynccontextmanager
async def served(until_s: float, token: str, port: int = 0) -> AsyncIterator[int]:
    """Serve a recording that ends at this time; yield the port."""
    told = [
        Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, "fell", "scout1", "", LogLevel.ALARM), SCOUT)
        for at_s in (1.0, until_s)
    ]
    file = recorded(told).getvalue()
    room = RecordingRoom(lambda: io.BytesIO(file), MissionClock.started_now())
    life = asyncio.create_task(room.run())
    pages = PageServer(room, Authenticator({token: TokenRights("", 1)}), PageFiles(), understand)
    try:
        async with pages.open("127.0.0.1", port) as server:
            yield port_of(server)
            await pages.end()
    finally:
        room.end("the test is over")
        await life


async def test_a_new_token_typed_at_a_page_of_another_recording_shows_the_new_one_whole() -> None:
    async with AsyncExitStack() as first, AsyncExitStack() as second:
        port = await first.enter_async_context(served(20.0, "first"))
        address = f"http://127.0.0.1:{port}/#token=first"
        page = await second.enter_async_context(
            web_browser.page_at("desktop", address, shows="#playback:not([hidden])")
        )
        line = page.locator("#play-line")
        assert await line.get_attribute("max") == "20"
        await first.aclose()
        await second.enter_async_context(served(90.0, "second", port))
        await page.locator("#login-token").fill("second")
        await page.keyboard.press("Enter")
        await page.locator("#play-at", has_text="of 90").wait_for()
        assert await line.get_attribute("max") == "90"
