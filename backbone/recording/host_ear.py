"""Where the recorder of a host hears what the processes of its host send, see ``bus.host_copies``."""

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
AT_ONCE = 4  # chosen: after a megabyte of one process the others have their turn
LOOK_EACH_S = 0.1  # chosen: to wake up for each copy costs more than to read it; a file is flushed less often
AGAIN_S = 0.001  # chosen: a sender fills its socket again meanwhile
_TOO_MANY_FILES = (errno.EMFILE, errno.ENFILE)

log = logging.getLogger(__name__)


class EarTaken(Refusal):
    """Another recorder hears the processes of this host."""

    code = "recording.taken"
    remedy = "End the other recorder of this mission on this host."


class HostEar:
    """Listens in the mission's folder of this host.

    It looks ten times a second and takes all that waits, however many copies were sent. Where a large copy is under way
    it looks again at once.

    Args:
        directory: The folder.
        is_of_mission: True: processes that send to it send their copies nowhere else.
    """

    def __init__(self, directory: Path, *, is_of_mission: bool) -> None:
        self._path = directory / (MISSION_SOCKET if is_of_mission else HOST_SOCKET)
        self._senders: dict[int, _CopySender] = {}
        self._gone = 0
        self._server: socket.socket | None = None
        self._next: asyncio.TimerHandle | None = None
        self._lacks_files = False
        self.on_lack: Callable[[str], None] = log.warning
        """Called with one line for people when a process cannot be heard, once for as long as that lasts; settable."""

    @property
    def dropped(self) -> int:
        """Messages that processes dropped because the recorder had no time for them."""
        return self._gone + sum(sender.dropped for sender in self._senders.values())

    async def open(self, listener: Overhearer, on_bug: Callable[[BaseException], None]) -> None:
        """Call ``listener(key, bytes)`` with each message from now on.

        Raises:
            EarTaken: Another recorder listens there.
            OSError: The system refuses the socket.
        """
        with closing(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)) as other:
            other.setblocking(False)
            with suppress(FileNotFoundError, ConnectionRefusedError):  # nobody, or a recorder that was killed
                other.connect(os.fspath(self._path))
                raise EarTaken(f"another recorder listens at {self._path}")
        remove_socket(self._path)
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.setblocking(False)
        self._server.bind(os.fspath(self._path))
        self._server.listen(socket.SOMAXCONN)  # a process that finds it full would look again a second later
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
        """Take all that waits now; return whether more may wait already. When: it is open."""
        is_more = False
        for number in [key.fd for key, _events in self._ready.select(0)]:
            sender = self._senders.get(number)
            if sender is None:
                is_more |= self._accept()
                continue
            try:
                is_more |= sender.hear(self._listener)
            except (ConnectionError, UnicodeDecodeError):
                self._leave(sender)  # the process has ended, or is none of the mission's
            except Exception as bug:
                self._on_bug(bug)
                self._leave(sender)
        return is_more

    def _look(self) -> None:
        after_s = AGAIN_S if self.hear() else LOOK_EACH_S
        self._next = asyncio.get_running_loop().call_later(after_s, self._look)

    def _accept(self) -> bool:
        """Take in all processes that wait; return whether there were any, who may have sent something already."""
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
                return was_there  # it was gone again
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
            if len(some) < READ_BYTES and not self._came:
                return False
        return True

    def _tell(self, listener: Overhearer) -> None:
        at = 0
        while (copy := copy_at(self._came, at)) is not None:
            self.dropped, at = copy.dropped, copy.end
            listener(copy.key, copy.raw)
        del self._came[:at]
