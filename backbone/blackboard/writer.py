"""The writer of a board: it never waits for a reader, and each reader finds the newest whole value, or each one.

A reader makes a pair of sockets and passes two descriptors to the writer: the end to send values to, and a second
handle of the reader's own end. With this handle the writer removes a value that the reader has not received yet, so
only the newest value waits. If a reader dies, its connection ends, and the system frees the value that waits for it.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import math
import os
import socket
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from backbone.blackboard import sealed_memory
from backbone.blackboard.values import (
    HEADER,
    MOST_IN_PACKET,
    MOST_VALUE_BYTES,
    NoBlackboard,
    WriterStands,
    files_of,
    require_short,
)
from backbone.operating_system import local_sockets

ACCEPT_AGAIN_S = 1.0  # chosen: as long as asyncio's own servers wait (asyncio.constants.ACCEPT_RETRY_DELAY)

log = logging.getLogger(__name__)


@dataclass(slots=True)
class _Outgoing:
    """A value as it is sent; the descriptor of its memory file is -1 if it travels in the packet."""

    head: bytes
    content: bytes = b""
    descriptor: int = -1

    @classmethod
    def of(cls, number: int, value: bytes | memoryview) -> _Outgoing:
        length = memoryview(value).nbytes
        head = HEADER.pack(number, length)
        return cls(head, bytes(value)) if length <= MOST_IN_PACKET else cls(head, b"", sealed_memory.sealed(value))

    def send(self, way: socket.socket) -> None:
        try:
            sealed_memory.send(way, (self.head, self.content), [self.descriptor] if self.descriptor >= 0 else [])
        except OSError as error:
            if error.errno != errno.EMSGSIZE or self.descriptor >= 0:
                raise
            self.descriptor, self.content = sealed_memory.sealed(self.content), b""  # this socket is smaller than most
            self.send(way)

    def close(self) -> None:
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


@dataclass(slots=True)
class _ConnectedReader:
    """A connected reader; before its first packet it has no sockets yet."""

    connection: socket.socket
    way: socket.socket | None = None
    undelivered: socket.socket | None = None

    def send(self, newest: _Outgoing, *, each: bool) -> None:
        """Replace the undelivered value by this one; until then the reader can still receive the former value.

        Args:
            each: True: send it after the undelivered values, not in their place.

        Raises:
            OSError: It cannot be sent; ``BlockingIOError``: the socket is full.
        """
        if self.way is None or self.undelivered is None:
            return
        if each:
            newest.send(self.way)
            return
        is_behind = bool(sealed_memory.peek(self.undelivered, 1))
        try:
            newest.send(self.way)
        except BlockingIOError:  # the former value fills the socket
            sealed_memory.take_back(self.undelivered, 1)
            newest.send(self.way)
            return
        if is_behind and sealed_memory.take_back(self.undelivered, HEADER.size) == newest.head:
            newest.send(self.way)  # the reader was quicker: this was the newest

    def close(self) -> None:
        for one in (self.connection, self.way, self.undelivered):
            if one is not None:
                one.close()


class BlackboardWriter:
    """The one writer of a named board. Its methods may be called from any thread.

    Readers are admitted with each ``put``. To admit them between two values, too, call ``serve_in_loop`` or
    ``serve_in_thread`` once.

    Args:
        directory: Folder of the boards; made if there is none. Only this user may be able to enter it.
        name: A legal name.
        most_bytes: Longest value.
        keeps: False: a value is for the present readers, so a newcomer never gets an old one.
        each: True: a reader gets each value put after its coming, in order; a value that its full socket does not admit
            is lost.

    Raises:
        WriterStands: Another writer of this name lives.
        NoBlackboard: The system has no sealed memory files.
        ForeignFolder: Other users can enter the folder.
        OSError: The system refuses the files.
    """

    def __init__(
        self,
        directory: Path,
        name: str,
        *,
        most_bytes: int = MOST_VALUE_BYTES,
        keeps: bool = True,
        each: bool = False,
    ) -> None:
        if not sealed_memory.IS_POSSIBLE:
            raise NoBlackboard("sealed memory files need Linux")
        self._directory, self._name, self._most, self._each = directory, name, most_bytes, each
        self.keeps = keeps
        """False: a value is for the present readers; settable."""
        self._socket_name, self._lock_name = files_of(name)
        held = sealed_memory.lock(directory, self._lock_name)
        if held is None:
            raise WriterStands(f"another writer of {name} lives", name=name)
        self._held = held
        with ExitStack() as undo:
            undo.callback(os.close, held)
            self._listening = undo.enter_context(sealed_memory.listen(directory, self._socket_name))
            self._events = sealed_memory.Waits()
            self._events.add(self._listening)
            undo.pop_all()
        self._guard = threading.RLock()
        self._readers: dict[int, _ConnectedReader] = {}
        self._newest: _Outgoing | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_open, self._is_served, self._accept_again_s = True, False, math.inf
        self.number = 0
        """Number of the newest value; 0: none yet."""
        self.lost = 0
        """Values that did not fit into a reader's socket; only with ``each``."""

    @property
    def has_readers(self) -> bool:
        """Whether a reader is connected."""
        return any(reader.way is not None for reader in self._readers.values())

    def put(self, value: bytes | memoryview) -> int:
        """Send this value to all readers, in place of values that they have not received; return its number.

        Never waits for a reader. The bytes are copied once; those of a view with gaps, which travel without the gaps,
        twice.

        Raises:
            ValueTooLong: It is longer than ``most_bytes``.
        """
        require_short(memoryview(value).nbytes, self._most)
        with self._guard:
            if not self._is_served:
                self.serve()
            if not self._is_open:
                return self.number
            self.number += 1
            if not (self.keeps or self._readers):
                return self.number
            sent = _Outgoing.of(self.number, value)
            self._forget()
            self._newest = sent
            for descriptor in tuple(self._readers):
                self._send_to(descriptor, sent)
            if self._each or not self.keeps:
                self._forget()
        return self.number

    def serve(self) -> None:
        """Admit new readers, which get the newest value at once if it is kept, and remove ended ones. Never waits."""
        with self._guard:
            if self._is_open and time.monotonic() >= self._accept_again_s:
                self._accept_again_s = math.inf
                self._events.add(self._listening)
            for descriptor in self._events.readable() if self._is_open else ():
                if descriptor == self._listening.fileno():
                    self._accept()
                elif descriptor in self._readers:
                    self._hear(descriptor)

    def serve_in_loop(self) -> None:
        """Call ``serve`` when readers come or go, in the running event loop; close the writer there."""
        self._is_served, self._loop = True, asyncio.get_running_loop()
        self._loop.add_reader(self._events.fileno(), self.serve)

    def serve_in_thread(self) -> threading.Thread:
        """Call ``serve`` when readers come or go, in a thread of its own, until the writer is closed."""
        self._is_served = True

        def run() -> None:
            while self._is_open:
                with suppress(ValueError):  # another thread has closed the writer just now
                    sealed_memory.wait_readable(self._events, _LOOK_FOR_END_S)
                self.serve()

        thread = threading.Thread(target=run, name="blackboard", daemon=True)
        thread.start()
        return thread

    def close(self) -> None:
        """Disconnect all readers, and free the name for another writer. Idempotent."""
        with self._guard:
            if not self._is_open:
                return
            self._is_open = False
            if self._loop is not None:
                self._loop.remove_reader(self._events.fileno())
            for descriptor in tuple(self._readers):
                self._let_go(descriptor)
            self._forget()
            self._listening.close()
            self._events.close()
            sealed_memory.remove(self._directory, self._socket_name)
            sealed_memory.remove(self._directory, self._lock_name)
            os.close(self._held)

    def _accept(self) -> None:
        while True:
            try:
                connection = local_sockets.accept(self._listening)
            except BlockingIOError:
                return
            except PermissionError:  # of another user; it is closed
                continue
            except OSError as error:  # no descriptors are left: a new reader waits
                log.warning("no further reader for now: %s", error)
                self._events.remove(self._listening.fileno())
                self._accept_again_s = time.monotonic() + ACCEPT_AGAIN_S
                if self._loop is not None:
                    self._loop.call_later(ACCEPT_AGAIN_S, self._accept_again)
                return
            self._readers[connection.fileno()] = _ConnectedReader(connection)
            self._events.add(connection)
            self._hear(connection.fileno())

    def _accept_again(self) -> None:
        """Admit readers again; no other call follows, and uvloop's timers are up to a millisecond early."""
        with self._guard:
            if self._accept_again_s < math.inf:
                self._accept_again_s = -math.inf
            self.serve()

    def _hear(self, descriptor: int) -> None:
        """Receive the two sockets of a new reader, or remove a reader that has ended."""
        reader = self._readers[descriptor]
        try:
            _packet, came = sealed_memory.receive(reader.connection, 1)
        except BlockingIOError:
            return
        except OSError:
            came = []
        if len(came) != 2 or reader.way is not None:
            sealed_memory.close_all(came)
            self._let_go(descriptor)
            return
        try:
            reader.way, reader.undelivered = _as_sockets(came)
        except OSError:
            self._let_go(descriptor)
            return
        if self.keeps and self._newest is not None:
            self._send_to(descriptor, self._newest)

    def _send_to(self, descriptor: int, sent: _Outgoing) -> None:
        try:
            self._readers[descriptor].send(sent, each=self._each)
        except BlockingIOError:  # its socket is full, or smaller than a packet
            if self._each:
                log.log(logging.DEBUG if self.lost else logging.WARNING, "a reader of %s does not read", self._name)
                self.lost += 1
        except OSError:
            self._let_go(descriptor)

    def _let_go(self, descriptor: int) -> None:
        self._events.remove(descriptor)
        self._readers.pop(descriptor).close()

    def _forget(self) -> None:
        if self._newest is not None:
            self._newest.close()
            self._newest = None


_LOOK_FOR_END_S = 0.2  # chosen: a closed writer's thread ends within it


def _as_sockets(descriptors: list[int]) -> tuple[socket.socket, socket.socket]:
    """Return two sockets that own these descriptors; all are closed on an error.

    Raises:
        OSError: One is no socket.
    """
    made: list[socket.socket] = []
    try:
        for descriptor in descriptors:
            one = socket.socket(fileno=descriptor)
            made.append(one)
            one.setblocking(False)
    except OSError:
        for one in made:
            one.close()
        sealed_memory.close_all(descriptors[len(made) :])
        raise
    return made[0], made[1]
