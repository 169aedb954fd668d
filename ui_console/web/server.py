"""The web console's server: its page, its socket, and the life of the component that listens to the mission."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from ssl import SSLContext

from ui_console.web.door import Doorkeeper
from ui_console.web.hub import WebHub
from ui_console.web.operator import Operator
from ui_console.web.protocol import Intent, understand
from ui_console.web.reception import Reception, port_of
from ui_console.web.site import Site


class WebServer:
    """Serves the page and its socket.

    Args:
        hub: Whom the operators work with.
        doorkeeper: Knows the tokens.
    """

    def __init__(self, hub: WebHub, doorkeeper: Doorkeeper) -> None:
        self._hub = hub
        self._reception: Reception[Operator, Intent] = Reception(hub, doorkeeper, Site(), understand)

    async def run(
        self, host: str, port: int, ready: Callable[[int], None], encryption: SSLContext | None = None
    ) -> None:
        """Serve until the hub's component has ended; all robots are given back then; see ``Reception.open``.

        Args:
            ready: Called with the port once browsers can come.

        Raises:
            CannotListen: The address cannot be had.
            BaseException: The bug that ended the component.
        """
        observer = self._hub.observer
        async with self._reception.open(host, port, encryption) as server:
            life = asyncio.create_task(observer.run(), name=f"life of {observer.address}")
            telling = asyncio.create_task(self._hub.tell_all(), name="web: tell all")
            telling.add_done_callback(
                lambda task: None if task.cancelled() else observer.end("nobody is told any more")
            )
            ready(port_of(server))
            try:
                await asyncio.wait({life})
            finally:
                telling.cancel()
                observer.end("the server ends")
                server.close()
                await asyncio.wait({life, telling})
        life.result()
        if not telling.cancelled():
            telling.result()
