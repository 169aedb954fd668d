"""Where the recorder of a host hears what the processes of its host send, see ``bus.host_copies``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from backbone.bus.host_copies import ALL_SOCKET, HEADER, PICTURES_SOCKET, remove_socket
from backbone.bus.interface import Overhearer
from backbone.waiting import end_tasks
from backbone.wire import MAX_MESSAGE_BYTES


class HostEar:
    """Listens in the mission's folder of this host.

    Args:
        directory: The folder.
        pictures_only: True: processes send their pictures only.
    """

    def __init__(self, directory: Path, *, pictures_only: bool) -> None:
        self._path = directory / (PICTURES_SOCKET if pictures_only else ALL_SOCKET)
        self._dropped: dict[asyncio.StreamWriter, int] = {}
        self._connections: set[asyncio.Task[None]] = set()
        self._gone = 0
        self._server: asyncio.Server | None = None

    @property
    def dropped(self) -> int:
        """Messages that processes dropped because the recorder had no time for them."""
        return self._gone + sum(self._dropped.values())

    async def open(self, listener: Overhearer, on_bug: Callable[[BaseException], None]) -> None:
        """Call ``listener(key, bytes)`` with each message from now on.

        Raises:
            OSError: The system refuses the socket.
        """

        def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            hearing = asyncio.create_task(self._hear_until_gone(reader, writer, listener, on_bug), name="host ear")
            self._connections.add(hearing)
            hearing.add_done_callback(self._connections.discard)

        remove_socket(self._path)
        self._server = await asyncio.start_unix_server(connected, self._path)

    async def close(self) -> None:
        """Stop listening. Idempotent."""
        if self._server is not None:
            self._server.close()
            remove_socket(self._path)
            await end_tasks(*self._connections)

    async def _hear_until_gone(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        listener: Overhearer,
        on_bug: Callable[[BaseException], None],
    ) -> None:
        self._dropped[writer] = 0
        try:
            await self._hear(reader, writer, listener)
        except (asyncio.IncompleteReadError, ConnectionError, UnicodeDecodeError):
            pass  # the process has ended, or is none of the mission's
        except Exception as bug:
            on_bug(bug)
        finally:
            self._gone += self._dropped.pop(writer)
            writer.close()

    async def _hear(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, listener: Overhearer) -> None:
        while True:
            length, self._dropped[writer], key_length = HEADER.unpack(await reader.readexactly(HEADER.size))
            if length > MAX_MESSAGE_BYTES:
                raise ConnectionError(f"a copy of {length} bytes")
            key = (await reader.readexactly(key_length)).decode()
            listener(key, await reader.readexactly(length))
