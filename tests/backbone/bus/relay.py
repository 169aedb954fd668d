"""A relay between a hub over TCP and its clients, on loopback: it delays, keeps back or ends their connections."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

LONGEST_KEEP_ALIVE = 2  # bytes, in zenoh 1.10
SHORTEST_PICTURE = 1000  # bytes; answers are shorter


class Relay:
    """Carries the messages between a hub and its clients.

    Args:
        hub_port: Where the hub listens.
        delay_s: Of each message on its way.

    Attributes:
        endpoint: Where clients connect.
        is_deaf: While it is set, the first connection passes only keep-alives and pictures to its client.
        reads: While it is not set, it reads nothing more.
    """

    def __init__(self, hub_port: int, delay_s: float) -> None:
        self.endpoint, self.is_deaf = "", asyncio.Event()
        self.reads = asyncio.Event()
        self.reads.set()
        self._hub_port, self._delay_s = hub_port, delay_s
        self._at_hub, self._at_client = list[asyncio.StreamWriter](), list[asyncio.StreamWriter]()
        self._stay_open, self._tasks = list[asyncio.StreamWriter](), set[asyncio.Task[None]]()

    def cut(self) -> None:
        """End all connections."""
        for stream in (*self._at_hub, *self._at_client):
            stream.close()

    def cut_at_hub(self) -> None:
        """End the hub's side of all connections; the clients' sides stay open."""
        self._stay_open.extend(self._at_client)
        for stream in self._at_hub:
            stream.close()

    def let_go(self) -> None:
        """End the clients' sides that stayed open."""
        for stream in self._stay_open:
            stream.close()

    async def connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Carry what comes over a new connection."""
        hub_reader, hub_writer = await asyncio.open_connection("127.0.0.1", self._hub_port)
        is_first = not self._at_hub
        self._at_hub.append(hub_writer)
        self._at_client.append(writer)
        self._tasks.add(asyncio.create_task(self._carry(reader, hub_writer, may_be_deaf=False)))
        self._tasks.add(asyncio.create_task(self._carry(hub_reader, writer, may_be_deaf=is_first)))

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, may_be_deaf: bool) -> None:
        try:
            while True:
                length = await reader.readexactly(2)
                batch = await reader.readexactly(int.from_bytes(length, "little"))
                await self.reads.wait()
                is_other = not LONGEST_KEEP_ALIVE < len(batch) < SHORTEST_PICTURE
                if is_other or not (may_be_deaf and self.is_deaf.is_set()):
                    asyncio.get_running_loop().call_later(self._delay_s, writer.write, length + batch)
        except (asyncio.IncompleteReadError, ConnectionError):
            if writer not in self._stay_open:
                writer.close()

    async def finish(self) -> None:
        """End all connections and what carries them."""
        self.cut()
        await asyncio.gather(*self._tasks, return_exceptions=True)


@asynccontextmanager
async def relay_to(hub_endpoint: str, delay_s: float = 0.0) -> AsyncIterator[Relay]:
    """Give a running relay to the hub at an endpoint over TCP."""
    relay = Relay(int(hub_endpoint.rpartition(":")[2]), delay_s)
    server = await asyncio.start_server(relay.connected, "127.0.0.1", 0)
    relay.endpoint = f"tcp/127.0.0.1:{server.sockets[0].getsockname()[1]}"
    try:
        yield relay
    finally:
        server.close()
        await relay.finish()
