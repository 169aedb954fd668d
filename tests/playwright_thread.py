"""One Chromium for all tests of a process: Playwright lives in a thread with an event loop of its own.

Each test has an event loop of its own, and a browser of Playwright belongs to the loop that started it. A browser and
its driver take a second of processor time to start; the thread starts them once.
"""

from __future__ import annotations

import asyncio
import inspect
import threading
from collections.abc import Awaitable, Callable
from typing import Any

OURS = "playwright."
ENDS_WITHIN_S = 20.0


class There:
    """An object of Playwright, used from the loop of a test.

    Calls and waits happen in Playwright's thread; objects of Playwright that come back are wrapped likewise. Handlers
    of events are called in that thread.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, wrapped: Any) -> None:
        self._loop, self._wrapped = loop, wrapped

    def __getattr__(self, name: str) -> Any:
        return self._here(getattr(self._wrapped, name))

    def __call__(self, *values: Any, **named: Any) -> Any:
        values = tuple(_unwrapped(one) for one in values)
        named = {name: _unwrapped(one) for name, one in named.items()}
        if inspect.iscoroutinefunction(self._wrapped):
            return self._awaited(self._wrapped(*values, **named))

        async def call() -> Any:
            return self._wrapped(*values, **named)

        return self._here(asyncio.run_coroutine_threadsafe(call(), self._loop).result())

    async def __aenter__(self) -> Any:
        return await self._awaited(self._wrapped.__aenter__())

    async def __aexit__(self, *raised: Any) -> Any:
        return await self._awaited(self._wrapped.__aexit__(*raised))

    async def _awaited(self, waiting: Awaitable[Any]) -> Any:
        async def wait() -> Any:
            return await waiting

        return self._here(await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(wait(), self._loop)))

    def _here(self, found: Any) -> Any:
        """Return what a test can use in its own loop."""
        if isinstance(found, list):
            return [self._here(one) for one in found]
        if inspect.isawaitable(found):
            return self._awaited(found)
        is_ours = type(found).__module__.startswith(OURS) or inspect.ismethod(found)
        return There(self._loop, found) if is_ours else found


def _unwrapped(value: Any) -> Any:
    return value.__dict__["_wrapped"] if isinstance(value, There) else value


class BrowserThread:
    """The thread and its browser, which is started when a test asks for it and again if it has crashed."""

    def __init__(self, launch: Callable[[Any], Awaitable[Any]]) -> None:
        """Start nothing yet.

        Args:
            launch: Playwright → a browser.
        """
        self._launch = launch
        self._loop: asyncio.AbstractEventLoop | None = None
        self._playwright: Any = None
        self._browser: Any = None

    async def browser(self) -> Any:
        """Return the browser, for use in the loop of the caller."""
        if self._loop is None:
            self._loop = asyncio.SelectorEventLoop()
            self._thread = threading.Thread(target=self._loop.run_forever, name="playwright", daemon=True)
            self._thread.start()
        await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(self._started(), self._loop))
        return There(self._loop, self._browser)

    def close(self) -> None:
        """End browser, driver and thread, if they were started."""
        if self._loop is not None:
            asyncio.run_coroutine_threadsafe(self._ended(), self._loop).result(ENDS_WITHIN_S)
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(ENDS_WITHIN_S)
            self._loop.close()
            self._loop = None

    async def _started(self) -> None:
        from playwright.async_api import async_playwright

        if self._playwright is None:
            self._playwright = await async_playwright().start()
        if self._browser is None or not self._browser.is_connected():
            self._browser = await self._launch(self._playwright)

    async def _ended(self) -> None:
        if self._browser is not None:
            await self._browser.close()
        if self._playwright is not None:
            await self._playwright.stop()
        self._playwright = self._browser = None
