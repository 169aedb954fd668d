"""The web console's server: pages, sockets, and the components that subscribe to the missions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from ssl import SSLContext
from typing import NamedTuple

from ui_console.web.hub import WebHub
from ui_console.web.login import Authenticator
from ui_console.web.operator import Operator
from ui_console.web.page_files import PageFiles
from ui_console.web.page_server import PageServer, open_pages, port_of
from ui_console.web.protocol import Intent, understand


class Console(NamedTuple):
    """The console of one mission.

    Attributes:
        hub: Shared by its operators.
        authenticator: Knows the tokens, which open this mission's pages only.
    """

    hub: WebHub
    authenticator: Authenticator


def path_of(mission: str, *, is_alone: bool) -> str:
    """Return the path of a mission's page; with several missions each has its own path.

    Example:
        >>> path_of("night", is_alone=True), path_of("night", is_alone=False)
        ('/', '/m/night/')
    """
    return "/" if is_alone else f"/m/{mission}/"


class WebServer:
    """Serves the pages and sockets of one or several missions.

    A page, its socket and its token belong to one mission, so no message of the page reaches another mission's robots.

    Args:
        consoles: Consoles of the missions; the missions have different names.
    """

    def __init__(self, *consoles: Console) -> None:
        self._consoles = consoles
        names = [one.hub.mission for one in consoles]
        self._pages: dict[str, PageServer[Operator, Intent]] = {}
        for hub, authenticator in consoles:
            hub.served = names
            at = path_of(hub.mission, is_alone=len(names) == 1)
            self._pages[at] = PageServer(hub, authenticator, PageFiles(), understand)

    async def run(
        self, host: str, port: int, ready: Callable[[int], None], encryption: SSLContext | None = None
    ) -> None:
        """Serve until each hub's component has ended, which releases its robots; see ``open_pages``.

        Args:
            ready: Called with the port once the server listens.

        Raises:
            CannotListen: The address is not free, or not one of this machine.
            BaseException: The bug that ended a component; it ends the server.
        """
        async with open_pages(self._pages, host, port, encryption) as server:
            lives = [
                asyncio.create_task(_live(console.hub, page), name=f"life of {console.hub.observer.address}")
                for console, page in zip(self._consoles, self._pages.values(), strict=True)
            ]
            ready(port_of(server))
            try:
                await asyncio.wait(lives, return_when=asyncio.FIRST_EXCEPTION)
            finally:
                for hub, _authenticator in self._consoles:
                    hub.observer.end("the server ends")
                server.close()
                await asyncio.wait(lives)
        for life in lives:
            life.result()


async def _live(hub: WebHub, page: PageServer[Operator, Intent]) -> None:
    """Serve one mission until its hub's component has ended.

    Raises:
        BaseException: The bug that ended it.
    """
    observer = hub.observer
    refreshing = asyncio.create_task(hub.refresh_all(), name="web: refresh all")
    refreshing.add_done_callback(
        lambda task: None if task.cancelled() else observer.end("the views are not refreshed any more")
    )
    try:
        await observer.run()
    finally:
        refreshing.cancel()
        await asyncio.wait({refreshing})
        await page.end()
    if not refreshing.cancelled():
        refreshing.result()
