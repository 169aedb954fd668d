"""Copies for the recorder of this host: a process sends copies of its messages over a unix socket, never by network.

The recorder listens in the mission's folder on its host, which only the mission's user can enter. If too many copies
wait, further copies are dropped and counted. Each copy is a header, its key and the bytes of its envelope.

The recorder of the mission has another socket than a recorder of one of the other hosts. A process whose copies go to
the recorder of the mission needs no further copies, see ``zenoh_far_copies``.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import socket
import struct
from collections import deque
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

from backbone.keys import Conversation
from backbone.wire import MAX_MESSAGE_BYTES

MISSION_SOCKET, HOST_SOCKET = "all.sock", "own.sock"  # no longer than the hub's name, whose path is checked
PICTURES = frozenset({Conversation.FRAMES, Conversation.VIEWS})
HEADER = struct.Struct("<IIH")
"""Length of the envelope, copies dropped so far (modulo 2³²), length of the key."""
MOST_WAITING_BYTES = 4 * 1024 * 1024  # chosen: a quarter of a second of four cameras in color; little memory for an RC
SMALL_BYTES = 4096  # chosen: to copy a page takes less time than a second system call
LOOK_EACH_S = 1.0  # chosen: a late recorder misses at most this time of a sending process; one check takes 20 µs

log = logging.getLogger(__name__)


class Copy(NamedTuple):
    """A copy as it arrives.

    Attributes:
        key: Key of the message; empty: none, only the number of dropped copies, from a process that ends.
        raw: Envelope of the message.
        dropped: Copies that its sender dropped before it.
        end: Where the next copy begins.
    """

    key: str
    raw: bytes
    dropped: int
    end: int


def header_of(key: str, raw: bytes, dropped: int = 0) -> bytes:
    """Return the header and the key of a copy; the bytes of the envelope follow them."""
    name = key.encode()
    return HEADER.pack(len(raw), dropped % 2**32, len(name)) + name


def copy_at(came: bytes | bytearray, at: int) -> Copy | None:
    """Return the copy that begins at this place; None: it has not arrived whole yet.

    Raises:
        ConnectionError: No copy begins there.
        UnicodeDecodeError: Its key is no text.
    """
    if len(came) - at < HEADER.size:
        return None
    length, dropped, key_length = HEADER.unpack_from(came, at)
    if length > MAX_MESSAGE_BYTES:
        raise ConnectionError(f"a copy of {length} bytes")
    middle = at + HEADER.size + key_length
    end = middle + length
    if end > len(came):
        return None
    return Copy(came[at + HEADER.size : middle].decode(), bytes(came[middle:end]), dropped, end)


class HostCopies:
    """The copies of one process. Make it inside a running event loop, and use it there.

    Args:
        directory: Folder of the mission's files on this host.
    """

    def __init__(self, directory: Path) -> None:
        self._directory, self._loop = directory, asyncio.get_running_loop()
        self._socket: socket.socket | None = None
        self._waiting: deque[tuple[memoryview, int | None]] = deque()  # with the last part of a copy, its ``dropped``
        self._waiting_bytes = self._counted = 0
        self._is_full = False
        self._look_again_s = -math.inf
        self.dropped = 0
        """Copies that were dropped because the present recorder, or else the last one, was too slow."""
        self.reach_mission = False
        """Whether the copies go to the recorder of the mission, not to that of one of its other hosts."""
        self._connect()

    def find_recorder(self) -> bool:
        """Return whether a recorder of this host listens; look for one again after ``LOOK_EACH_S``.

        No timer looks for a recorder, so a process that sends nothing is not woken.
        """
        if self._socket is None and self._loop.time() >= self._look_again_s:
            self._connect()
        return self._socket is not None

    def look_now(self) -> None:
        """Look for a recorder with the next message."""
        self._look_again_s = -math.inf

    def send(self, key: str, raw: bytes) -> None:
        """Send a copy, or drop it if too much waits. Never waits."""
        if self._socket is None:
            return
        if self._waiting and self._waiting_bytes + len(raw) > MOST_WAITING_BYTES:
            self.dropped += 1
            return
        header = header_of(key, raw, self.dropped)
        if len(raw) > SMALL_BYTES:
            self._waiting.append((memoryview(header), None))
            self._waiting.append((memoryview(raw), self.dropped))
        else:
            self._waiting.append((memoryview(header + raw), self.dropped))
        self._waiting_bytes += len(header) + len(raw)
        if not self._is_full:
            self._send_waiting()

    def close(self) -> None:
        """Send no more. Idempotent.

        A recorder that is too slow learns by a connection of its own how many copies it does not get, because the
        other one is full.
        """
        lost = self.dropped - self._counted + sum(dropped is not None for _part, dropped in self._waiting)
        if self._socket is not None and lost:
            with suppress(OSError), closing(_connected(Path(self._socket.getpeername()))) as farewell:
                farewell.send(header_of("", b"", lost))
        self._disconnect()
        self._look_again_s = math.inf

    def _connect(self) -> None:
        self._look_again_s = self._loop.time() + LOOK_EACH_S
        for name in (MISSION_SOCKET, HOST_SOCKET):
            with suppress(OSError):  # no recorder listens there, or no descriptors are left
                made = _connected(self._directory / name)
                self._socket, self.reach_mission, self.dropped, self._counted = made, name == MISSION_SOCKET, 0, 0
                self._loop.add_reader(made, self._ended)
                return

    def _ended(self) -> None:
        """Look for another recorder with the next message. A recorder sends nothing, so a readable socket has ended."""
        self._disconnect()
        self.look_now()

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._become_full(False)
            self._loop.remove_reader(self._socket)
            self._socket.close()
        self._socket = None
        self._waiting.clear()
        self._waiting_bytes = 0

    def _send_waiting(self) -> None:
        assert self._socket is not None  # noqa: S101  a writer of the socket, or called beside it
        try:
            while self._waiting:
                part, dropped = self._waiting[0]
                sent = self._socket.send(part)
                self._waiting_bytes -= sent
                if sent < len(part):
                    self._waiting[0] = part[sent:], dropped
                    continue
                self._waiting.popleft()
                self._counted = self._counted if dropped is None else dropped
        except BlockingIOError:
            self._become_full(True)
        except OSError as error:
            log.info("the recorder of this host is gone: %s", error)
            self._disconnect()
        else:
            self._become_full(False)

    def _become_full(self, is_full: bool) -> None:
        """If the socket is full, send the rest when it has room again."""
        if is_full is not self._is_full and self._socket is not None:
            self._is_full = is_full
            if is_full:
                self._loop.add_writer(self._socket, self._send_waiting)
            else:
                self._loop.remove_writer(self._socket)


def _connected(path: Path) -> socket.socket:
    """Return a connection that never blocks.

    Raises:
        OSError: There is none.
    """
    made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        made.setblocking(False)
        made.connect(os.fspath(path))
    except OSError:
        made.close()
        raise
    return made


def copies_for(directory: str) -> HostCopies | None:
    """Return the copies of this process; None if its launch names no folder."""
    return HostCopies(Path(directory)) if directory else None


def remove_socket(path: Path) -> None:
    """Remove the socket file that a killed recorder left."""
    with suppress(FileNotFoundError):
        path.unlink()
