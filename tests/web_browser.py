"""A real browser before a page of ours, hands for it, and a cable that can be cut.

Screenshots for the documents are kept where ``SCOUT_PICTURES`` says.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import AsyncIterator, Collection
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright_thread import BrowserThread

WITHIN_S = 30.0
SIZES = {"desktop": (1440, 900), "tablet": (820, 1180), "phone": (390, 844)}
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), "")
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--force-color-profile=srgb"]
CHROMIUM_THREAD = BrowserThread(lambda playwright: playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS))
KEPT: dict[str, Any] = {}
"""By size, the page that the last test left blank. To open it costs 0.5 s of processor time, a new page 1.4 s."""
KEYS = ("d", "Enter", "Alt", "Meta", "Shift", "Control", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown")
"""What a test may leave pressed."""


@asynccontextmanager
async def page_at(
    size: str,
    address: str,
    *,
    shows: str,
    script: str = "",
    theme: str = "dark",
    expects: Collection[str] = ("WebSocket",),
    may_be_kept: bool = False,
) -> AsyncIterator[Any]:
    """Open a page of this size that knows nothing of an earlier one; anything it complains about fails the test.

    Args:
        size: Of ``SIZES``.
        address: With the token.
        shows: What is on the page once it is connected.
        script: Run before the page's own.
        theme: What the system likes: light or dark.
        expects: Words of complaints that are no fault of the page.
        may_be_kept: The page may be one that another test left, and the next test may have it, unless this one fails
            or has a script. Such a test ends what it listens to, and lifts its finger.
    """
    pytest.importorskip("playwright.async_api", reason="playwright is not installed")
    if not CHROMIUM:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    complaints: list[str] = []
    heard = {
        "pageerror": lambda error: complaints.append(str(error)),
        "console": lambda said: complaints.append(said.text) if said.type == "error" else None,
    }
    async with (_kept_page if may_be_kept and not script else _fresh_page)(size, theme) as page:
        await page.add_init_script(script)
        page.set_default_timeout(1000 * WITHIN_S)
        for event, hear in heard.items():
            page.on(event, hear)
        await page.goto(f"{address}&user={size}")
        await page.wait_for_selector(shows)
        yield page
        assert [one for one in complaints if not any(words in one for words in expects)] == []
        for event, hear in heard.items():
            page.remove_listener(event, hear)


@asynccontextmanager
async def _fresh_page(size: str, theme: str) -> AsyncIterator[Any]:
    """Give a page in a context of its own, which ends with the block."""
    page = await _new_page(size, theme)
    try:
        yield page
    finally:
        await page.context.close()


@asynccontextmanager
async def _kept_page(size: str, theme: str) -> AsyncIterator[Any]:
    """Give a page that is like new, and keep it if the block ends well."""
    page = KEPT.pop(size, None)
    if page is None or not page.context.browser.is_connected():
        page = await _new_page(size, theme)
    try:
        await page.emulate_media(color_scheme=theme)
        yield page
        await _leave_blank(page)
    except BaseException:
        await page.context.close()
        raise
    if KEPT.setdefault(size, page) is not page:
        await page.context.close()


async def _new_page(size: str, theme: str) -> Any:
    width, height = SIZES[size]
    browser = await CHROMIUM_THREAD.browser()
    context = await browser.new_context(
        viewport={"width": width, "height": height},
        has_touch=size != "desktop",
        is_mobile=size == "phone",
        color_scheme=theme,
    )
    return await context.new_page()


async def _leave_blank(page: Any) -> None:
    """Have nothing kept, shown or pressed."""
    await page.evaluate("() => { sessionStorage.clear(); window.name = ''; }")
    await page.goto("about:blank")
    tools = await page.context.new_cdp_session(page)
    await tools.send("Storage.clearDataForOrigin", {"origin": "*", "storageTypes": "all"})
    await tools.detach()
    for key in KEYS:
        await page.keyboard.up(key)
    for button in ("left", "middle", "right"):
        await page.mouse.up(button=button)
    await page.mouse.move(0, 0)


async def keep_picture(page: Any, name: str) -> None:
    """Take a screenshot for the documents if they are to be had."""
    folder = os.environ.get("SCOUT_PICTURES")
    if folder:
        await page.screenshot(path=Path(folder) / f"{name}.jpg", type="jpeg", quality=60)


async def assert_no_sideways_scroll(page: Any) -> None:
    overhang_px = await page.locator("html").evaluate("page => page.scrollWidth - page.clientWidth")
    assert overhang_px <= 0


class Finger:
    """A finger on the screen."""

    def __init__(self, page: Any) -> None:
        self._page = page

    async def push_right(self) -> None:
        """Put it down in the middle of the drive pad and move it to the right."""
        await self._page.locator("#pad").scroll_into_view_if_needed()
        box = await self._page.locator("#pad").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        await self.put_down(x, y)
        await self.move(x + 0.45 * box["width"], y)

    async def put_down(self, x: float, y: float) -> None:
        self._touches = await self._page.context.new_cdp_session(self._page)
        await self._send("touchStart", [{"x": x, "y": y}])

    async def move(self, x: float, y: float) -> None:
        """Move it there without lifting it."""
        await self._send("touchMove", [{"x": x, "y": y}])

    async def lift(self) -> None:
        """Take it away."""
        await self._send("touchEnd", [])

    async def _send(self, kind: str, points: list[dict[str, float]]) -> None:
        await self._touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


class Cable:
    """A connection to the server that can be cut, also one way: messages are dropped without notice to either end.

    Attributes:
        may_pass: While it is clear, everything waits on its way, and arrives in a burst afterwards.
    """

    def __init__(self, to_port: int) -> None:
        self._to_port, self.port = to_port, 0
        self.is_cut_up = self.is_cut_down = False
        self.may_pass = asyncio.Event()
        self.may_pass.set()
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def is_cut(self) -> bool:
        return self.is_cut_up and self.is_cut_down

    @is_cut.setter
    def is_cut(self, is_cut: bool) -> None:
        self.is_cut_up = self.is_cut_down = is_cut

    @asynccontextmanager
    async def plugged_in(self) -> AsyncIterator[Cable]:
        server = await asyncio.start_server(self._meet, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        try:
            yield self
        finally:
            server.close()
            for task in list(self._tasks):
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._to_port)
        try:
            await asyncio.gather(
                self._carry(reader, far_writer, is_up=True), self._carry(far_reader, writer, is_up=False)
            )
        finally:
            writer.close()
            far_writer.close()

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, is_up: bool) -> None:
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(65536):
                await self.may_pass.wait()
                if not (self.is_cut_up if is_up else self.is_cut_down):
                    writer.write(data)
                    await writer.drain()
            if not self.is_cut:
                writer.close()
