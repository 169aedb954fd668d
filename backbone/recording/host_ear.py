"""The recorder's end of the copies that processes of its host send, see ``bus.host_copies``."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import selectors
import socket
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

from backbone.bus.host_copies import HOST_SOCKET, MISSION_SOCKET, copy_at, remove_socket
from backbone.bus.interface import Overhearer
from backbone.errors import Refusal

READ_BYTES = 256 * 1024  # chosen: as much as a unix socket holds by default on Linux
AT_ONCE = 4  # chosen: after a megabyte of one process, the other processes are read
FULL_BYTES = 16 * 1024  # measured: as many bytes of the smallest copies fill a unix socket, because each has overhead
LOOK_EACH_S = 0.1  # chosen: waking up for each copy costs more than reading it; a file is flushed less often
AGAIN_S = 0.001  # chosen: meanwhile a sender fills its socket again
_TOO_MANY_FILES = (errno.EMFILE, errno.ENFILE)

log = logging.getLogger(__name__)


class EarTaken(Refusal):
    """Another recorder receives the copies of this host's processes."""

    code = "recording.taken"
    remedy = "End the other recorder of this mission on this host."


class HostEar:
    """Receives copies at a socket in the mission's folder of this host.

    Ten times a second it reads all copies that wait. If a large copy has arrived only in part, or a process may have
    filled its socket, it reads again at once.

    Args:
        directory: The folder.
        is_of_mission: True: processes that send copies here send them nowhere else.
    """

    def __init__(self, directory: Path, *, is_of_mission: bool) -> None:
        self._path = directory / (MISSION_SOCKET if is_of_mission else HOST_SOCKET)
        self._senders: dict[int, _CopySender] = {}
        self._gone = 0
        self._server: socket.socket | None = None
        self._next: asyncio.TimerHandle | None = None
        self._lacks_files = False
        self.on_lack: Callable[[str], None] = log.warning
        """Called with a line for people when a process's copies cannot be received, once while that lasts; settable."""

    @property
    def dropped(self) -> int:
        """Number of messages that processes dropped because the recorder was too slow."""
        return self._gone + sum(sender.dropped for sender in self._senders.values())

    async def open(self, listener: Overhearer, on_bug: Callable[[BaseException], None]) -> None:
        """Call ``listener(key, bytes)`` with each message from now on.

        Raises:
            EarTaken: Another recorder listens there.
            OSError: The system refuses the socket.
        """
        with closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as other:
            other.setblocking(False)
            with suppress(FileNotFoundError, ConnectionRefusedError):  # no recorder, or a recorder that was killed
                other.connect(os.fspath(self._path))
                raise EarTaken(f"another recorder listens at {self._path}")
        remove_socket(self._path)
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.setblocking(False)
        self._server.bind(os.fspath(self._path))
        self._server.listen(socket.SOMAXCONN)  # if the queue is full, a process retries only a second later
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._server, selectors.EVENT_READ)
        self._listener, self._on_bug = listener, on_bug
        self._look()

    async def close(self) -> None:
        """Stop listening. Idempotent."""
        if self._server is not None and self._next is not None:
            self._next.cancel()
            self._server.close()
            remove_socket(self._path)
            for sender in tuple(self._senders.values()):
                self._leave(sender)
            self._ready.close()
            self._server = None

    def hear(self) -> bool:
        """Read all copies that wait; return whether more may wait already. Call it only while open."""
        is_more = False
        for number in [key.fd for key, _events in self._ready.select(0)]:
            sender = self._senders.get(number)
            if sender is None:
                is_more |= self._accept()
                continue
            try:
                is_more |= sender.hear(self._listener)
            except (ConnectionError, UnicodeDecodeError):
                self._leave(sender)  # the process has ended, or is not a process of the mission
            except Exception as bug:
                self._on_bug(bug)
                self._leave(sender)
        return is_more

    def _look(self) -> None:
        after_s = AGAIN_S if self.hear() else LOOK_EACH_S
        self._next = asyncio.get_running_loop().call_later(after_s, self._look)

    def _accept(self) -> bool:
        """Accept all processes that wait; return whether there were any, because they may have sent copies already."""
        assert self._server is not None  # noqa: S101  it is open
        was_there = False
        try:
            while True:
                connection, _address = self._server.accept()
                connection.setblocking(False)
                self._senders[connection.fileno()] = _CopySender(connection)
                self._ready.register(connection, selectors.EVENT_READ)
                self._lacks_files, was_there = False, True
        except BlockingIOError:
            return was_there
        except OSError as error:
            if error.errno not in _TOO_MANY_FILES:
                return was_there  # the process has closed the connection again
            if not self._lacks_files:
                self._lacks_files = True
                self.on_lack(
                    "cannot hear a process of this host: too many files are open; "
                    "raise the limit ('ulimit -n') and begin the recording anew"
                )
            return False

    def _leave(self, sender: _CopySender) -> None:
        del self._senders[sender.connection.fileno()]
        self._ready.unregister(sender.connection)
        self._gone += sender.dropped
        sender.connection.close()


class _CopySender:
    """The copies of one process."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection, self.dropped = connection, 0
        self._came = bytearray()

    def hear(self, listener: Overhearer) -> bool:
        """Read the copies that wait; return whether more may wait already.

        Raises:
            ConnectionError: The process is gone, or sends illegal bytes.
            UnicodeDecodeError: The process sends illegal bytes.
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
            if len(some) < READ_BYTES and not self._came:
                return len(some) > FULL_BYTES
        return True

    def _tell(self, listener: Overhearer) -> None:
        at = 0
        while (copy := copy_at(self._came, at)) is not None:
            self.dropped, at = copy.dropped, copy.end
            if copy.key:
                listener(copy.key, copy.raw)
        del self._came[:at]
