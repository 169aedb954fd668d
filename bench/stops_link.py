"""A link that can be cut. While it is cut, its bytes wait, as on a network that drops every packet."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import msgspec

from backbone import run_files

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
CHUNK_BYTES = 65536
SOCKET = "unixsock-stream/"


class Relay:
    """Carries bytes both ways, except while it is cut.

    Args:
        connect: Opens a connection to the far end.
    """

    def __init__(self, connect: Callable[[], Awaitable[Streams]]) -> None:
        self._connect = connect
        self._passes = asyncio.Event()
        self._passes.set()
        self._tasks: set[asyncio.Task[None]] = set()

    def cut(self) -> None:
        """Stop carrying bytes from now on, without notice to either end."""
        self._passes.clear()

    def heal(self) -> None:
        """Carry bytes again, first those that waited."""
        self._passes.set()

    async def meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Carry one connection until one of its ends closes it."""
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        far: asyncio.StreamWriter | None = None
        try:
            await self._passes.wait()
            far_reader, far = await self._connect()
            there, back = self._carry(reader, far), self._carry(far_reader, writer)
            await asyncio.gather(there, back)
        except (ConnectionError, FileNotFoundError, asyncio.CancelledError):
            return  # only ``close`` cancels it; asyncio would report that as a fault of this callback
        finally:
            self._tasks.discard(task)
            for one in filter(None, (writer, far)):
                one.close()

    async def close(self) -> None:
        """End all connections."""
        tasks = set(self._tasks)
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(CHUNK_BYTES):
                await self._passes.wait()
                writer.write(data)
                await writer.drain()
        writer.close()


@asynccontextmanager
async def relay_to_port(port: int) -> AsyncIterator[tuple[Relay, int]]:
    """Run a relay to a port of this machine; yield it and its own port."""
    relay = Relay(lambda: asyncio.open_connection("127.0.0.1", port))
    server = await asyncio.start_server(relay.meet, "127.0.0.1", 0)
    try:
        yield relay, server.sockets[0].getsockname()[1]
    finally:
        server.close()
        await relay.close()


@asynccontextmanager
async def relay_to_mission(found: run_files.RunFile, folder: Path) -> AsyncIterator[Relay]:
    """Make a runtime folder in which the mission's hub is reached through a relay; yield the relay."""
    own = folder / "scout-backbone" / found.mission
    own.mkdir(parents=True, mode=0o700)
    socket = own / "hub.sock"
    relay = Relay(lambda: asyncio.open_unix_connection(found.endpoint.removeprefix(SOCKET)))
    server = await asyncio.start_unix_server(relay.meet, str(socket))
    here = msgspec.structs.replace(found, endpoint=f"{SOCKET}{socket}")
    (own / run_files.FILE_NAME).write_bytes(msgspec.json.encode(here))
    try:
        yield relay
    finally:
        server.close()
        await relay.close()
