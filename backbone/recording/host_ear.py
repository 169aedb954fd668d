"""Where the recorder of a host hears what the processes of its host send, see ``bus.host_copies``."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from pathlib import Path

from backbone.bus.host_copies import ALL_SOCKET, HEADER, PICTURES_SOCKET, remove_socket
from backbone.bus.inbox import GATHER_S
from backbone.bus.interface import Overhearer
from backbone.wire import MAX_MESSAGE_BYTES

READ_BYTES = 256 * 1024  # chosen: as much as a unix socket holds by default on Linux
AT_ONCE = 4  # chosen: after a megabyte of one process the others have their turn
AGAIN_S = 0.001  # chosen: a sender fills its socket again meanwhile


class HostEar:
    """Listens in the mission's folder of this host.

    It looks twenty times a second and takes all that waits, however many copies were sent. Where a large copy is under
    way it looks again at once.

    Args:
        directory: The folder.
        pictures_only: True: processes send their pictures only.
    """

    def __init__(self, directory: Path, *, pictures_only: bool) -> None:
        self._path = directory / (PICTURES_SOCKET if pictures_only else ALL_SOCKET)
        self._senders: list[_CopySender] = []
        self._gone = 0
        self._server: socket.socket | None = None
        self._next: asyncio.TimerHandle | None = None

    @property
    def dropped(self) -> int:
        """Messages that processes dropped because the recorder had no time for them."""
        return self._gone + sum(sender.dropped for sender in self._senders)

    async def open(self, listener: Overhearer, on_bug: Callable[[BaseException], None]) -> None:
        """Call ``listener(key, bytes)`` with each message from now on.

        Raises:
            OSError: The system refuses the socket.
        """
        remove_socket(self._path)
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.setblocking(False)
        self._server.bind(os.fspath(self._path))
        self._server.listen(socket.SOMAXCONN)  # a process that finds it full would look again a second later
        self._look(self._server, listener, on_bug)

    async def close(self) -> None:
        """Stop listening. Idempotent."""
        if self._server is not None and self._next is not None:
            self._next.cancel()
            self._server.close()
            remove_socket(self._path)
            for sender in tuple(self._senders):
                self._leave(sender)

    def _look(self, server: socket.socket, listener: Overhearer, on_bug: Callable[[BaseException], None]) -> None:
        self._accept(server)
        is_more = False
        for sender in tuple(self._senders):
            try:
                is_more |= sender.hear(listener)
            except (ConnectionError, UnicodeDecodeError):
                self._leave(sender)  # the process has ended, or is none of the mission's
            except Exception as bug:
                on_bug(bug)
                self._leave(sender)
        after_s = AGAIN_S if is_more else GATHER_S
        self._next = asyncio.get_running_loop().call_later(after_s, self._look, server, listener, on_bug)

    def _accept(self, server: socket.socket) -> None:
        try:
            while True:
                connection, _address = server.accept()
                connection.setblocking(False)
                self._senders.append(_CopySender(connection))
        except OSError:  # nobody more, or no more files can be opened: then they wait
            return

    def _leave(self, sender: _CopySender) -> None:
        self._senders.remove(sender)
        self._gone += sender.dropped
        sender.connection.close()


class _CopySender:
    """The copies of one process."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection, self.dropped = connection, 0
        self._came = bytearray()

    def hear(self, listener: Overhearer) -> bool:
        """Take what waits; return whether more may wait already.

        Raises:
            ConnectionError: The process is gone, or sends nonsense.
            UnicodeDecodeError: It sends nonsense.
        """
        for attempt in range(AT_ONCE):
            try:
                some = self.connection.recv(READ_BYTES)
            except BlockingIOError:
                return attempt > 0 and bool(self._came)  # a large copy is under way, and its sender does not hang
            if not some:
                raise ConnectionError("it has ended")
            self._came += some
            self._tell(listener)
        return True

    def _tell(self, listener: Overhearer) -> None:
        at = 0
        while len(self._came) - at >= HEADER.size:
            length, dropped, key_length = HEADER.unpack_from(self._came, at)
            if length > MAX_MESSAGE_BYTES:
                raise ConnectionError(f"a copy of {length} bytes")
            self.dropped, begin = dropped, at + HEADER.size
            end = begin + key_length + length
            if end > len(self._came):
                break
            listener(self._came[begin : begin + key_length].decode(), bytes(self._came[begin + key_length : end]))
            at = end
        del self._came[:at]
