"""Copies for the recorder of this host: what a process sends goes to it over a unix socket, never over the network.

The recorder listens in the mission's folder on its host, which only the mission's user can enter. A copy is dropped and
counted rather than waited for. Each copy is a header, its key and the bytes of its envelope.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import socket
import struct
from collections import deque
from contextlib import suppress
from pathlib import Path

from backbone.keys import Conversation

ALL_SOCKET, PICTURES_SOCKET = "all.sock", "pic.sock"  # as long as the hub's name, whose path is checked to be possible
PICTURES = frozenset({Conversation.FRAMES, Conversation.VIEWS})
HEADER = struct.Struct("<IIH")
"""Length of the envelope, copies dropped so far (modulo 2³²), length of the key."""
MOST_WAITING_BYTES = 4 * 1024 * 1024  # chosen: a quarter of a second of four cameras in color, and no burden for an RC
LOOK_EACH_S = 1.0  # chosen: a recorder that begins late misses so much of a process that speaks; a look takes 20 µs

log = logging.getLogger(__name__)


class HostCopies:
    """The copies of one process. Make it inside a running event loop, and use it there.

    Args:
        directory: Folder of the mission's files on this host.
    """

    def __init__(self, directory: Path) -> None:
        self._directory, self._loop = directory, asyncio.get_running_loop()
        self._socket: socket.socket | None = None
        self._only: frozenset[Conversation] | None = None
        self._waiting: deque[memoryview] = deque()
        self._waiting_bytes = 0
        self._is_full = False
        self._look_again_s = -math.inf
        self.dropped = 0
        """Copies for which the recorder had no time."""
        self._connect()

    def wants(self, conversation: Conversation) -> bool:
        """Return whether a recorder of this host listens to this conversation; looks for one from time to time.

        So a process that says nothing is not woken for it.
        """
        if self._socket is None and self._loop.time() >= self._look_again_s:
            self._connect()
        return self._socket is not None and (self._only is None or conversation in self._only)

    def send(self, key: str, raw: bytes) -> None:
        """Send a copy, or drop it if too much waits. Never waits."""
        if self._socket is None:
            return
        name = key.encode()
        if self._waiting and self._waiting_bytes + len(raw) > MOST_WAITING_BYTES:
            self.dropped += 1
            return
        for part in (HEADER.pack(len(raw), self.dropped % 2**32, len(name)) + name, raw):
            self._waiting.append(memoryview(part))
            self._waiting_bytes += len(part)
        if not self._is_full:
            self._send_waiting()

    def close(self) -> None:
        """Send no more. Idempotent."""
        self._disconnect()
        self._look_again_s = math.inf

    def _connect(self) -> None:
        self._look_again_s = self._loop.time() + LOOK_EACH_S
        for name, only in ((ALL_SOCKET, None), (PICTURES_SOCKET, PICTURES)):
            made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            made.setblocking(False)
            try:
                made.connect(os.fspath(self._directory / name))
            except OSError:
                made.close()
            else:
                self._socket, self._only = made, only
                return

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._become_full(False)
            self._socket.close()
        self._socket = None
        self._waiting.clear()
        self._waiting_bytes = 0

    def _send_waiting(self) -> None:
        assert self._socket is not None  # noqa: S101  a writer of the socket, or called beside it
        try:
            while self._waiting:
                sent = self._socket.send(self._waiting[0])
                self._waiting_bytes -= sent
                if sent == len(self._waiting[0]):
                    self._waiting.popleft()
                else:
                    self._waiting[0] = self._waiting[0][sent:]
        except BlockingIOError:
            self._become_full(True)
        except OSError as error:
            log.info("the recorder of this host is gone: %s", error)
            self._disconnect()
        else:
            self._become_full(False)

    def _become_full(self, is_full: bool) -> None:
        """Send the rest when the socket has room, if it is full."""
        if is_full is not self._is_full and self._socket is not None:
            self._is_full = is_full
            if is_full:
                self._loop.add_writer(self._socket, self._send_waiting)
            else:
                self._loop.remove_writer(self._socket)


def copies_for(directory: str) -> HostCopies | None:
    """Return the copies of this process; None if its launch names no folder."""
    return HostCopies(Path(directory)) if directory else None


def remove_socket(path: Path) -> None:
    """Remove what a killed recorder left."""
    with suppress(FileNotFoundError):
        path.unlink()
