"""The web console's server: its page, its socket, and the life of the component that subscribes to the mission."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from ssl import SSLContext

from ui_console.web.hub import WebHub
from ui_console.web.login import Authenticator
from ui_console.web.operator import Operator
from ui_console.web.page_files import PageFiles
from ui_console.web.page_server import PageServer, port_of
from ui_console.web.protocol import Intent, understand


class WebServer:
    """Serves the page and its socket.

    Args:
        hub: Shared by the operators.
        authenticator: Knows the tokens.
    """

    def __init__(self, hub: WebHub, authenticator: Authenticator) -> None:
        self._hub = hub
        self._page_server: PageServer[Operator, Intent] = PageServer(hub, authenticator, PageFiles(), understand)

    async def run(
        self, host: str, port: int, ready: Callable[[int], None], encryption: SSLContext | None = None
    ) -> None:
        """Serve until the hub's component has ended; all robots are given back then; see ``Reception.open``.

        Args:
            ready: Called with the port once the server listens.

        Raises:
            CannotListen: The address is not free, or not one of this machine.
            BaseException: The bug that ended the component.
        """
        observer = self._hub.observer
        async with self._page_server.open(host, port, encryption) as server:
            life = asyncio.create_task(observer.run(), name=f"life of {observer.address}")
            refreshing = asyncio.create_task(self._hub.refresh_all(), name="web: refresh all")
            refreshing.add_done_callback(
                lambda task: None if task.cancelled() else observer.end("the views are not refreshed any more")
            )
            ready(port_of(server))
            try:
                await asyncio.wait({life})
            finally:
                refreshing.cancel()
                observer.end("the server ends")
                server.close()
                await asyncio.wait({life, refreshing})
        life.result()
        if not refreshing.cancelled():
            refreshing.result()
