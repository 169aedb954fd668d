"""Sockets that a library opened in this process: their close must not block, and a useless one is shut down.

What zenoh has written to a socket, no message of a higher urgency overtakes. So the system keeps at most
``MOST_UNSENT_BYTES`` that it has not sent yet. Pictures wait and are dropped in zenoh's queues, not there.

A TCP link of zenoh lingers: its close blocks the thread that closes it until the peer has acknowledged all data, 10 s
at most (zenoh 1.10, ``TCP_LINGER_TIMEOUT``). If a cable is cut, this blocks the few threads through which a hub
receives. Then every component waits, and a session that connects again meanwhile gets a link without messages.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from collections.abc import Callable
from pathlib import Path

from backbone.authentication import SOCKET

# Four batches (``LINK_BATCH_BYTES``). Measured with pictures of 77 kB over 4 Mbit/s: a question waited for 0.2 s in
# place of 0.5 s; with 16 KiB hardly any picture arrived.
MOST_UNSENT_BYTES = 64 * 1024
_RECEIVED = struct.Struct("=128xQ")  # linux/tcp.h, struct tcp_info: tcpi_bytes_received
_NO_LINGER = struct.pack("ii", 0, 0)  # the system's default: close returns at once, and the system sends the rest


def set_options() -> None:
    """Make the close of every present TCP socket of this process return at once, and limit its unsent bytes."""
    _for_each(_set_options_of)


def shut_down(local: str, peer: str) -> None:
    """End this process's connections between two locators of zenoh: each peer closes first, then this process.

    A connection by a unix socket is known by its peer only, because its own end has no address.
    """
    _for_each(lambda one: one.shutdown(socket.SHUT_WR) if _is_between(one, local, peer) else None)


def received_bytes(local: str, peer: str) -> int:
    """Return how many bytes came over these connections; 0 if there is none, or by a unix socket."""
    counts: list[int] = []

    def count(one: socket.socket) -> None:
        if one.family != socket.AF_UNIX and _is_between(one, local, peer):
            counts.extend(_RECEIVED.unpack(one.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _RECEIVED.size)))

    _for_each(count)
    return sum(counts)


def _is_between(one: socket.socket, local: str, peer: str) -> bool:
    if one.family == socket.AF_UNIX:
        return peer == f"{SOCKET}{one.getpeername()}"
    return local.endswith(f":{one.getsockname()[1]}")


def _set_options_of(one: socket.socket) -> None:
    if one.family != socket.AF_UNIX:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, MOST_UNSENT_BYTES)


def _for_each(act: Callable[[socket.socket], None]) -> None:
    """Call a function with another handle of each present stream socket of this process."""
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError), _same_socket(int(entry.name)) as same:  # no socket, or closed meanwhile
            if same.family in (socket.AF_INET, socket.AF_INET6, socket.AF_UNIX) and same.type == socket.SOCK_STREAM:
                act(same)


def _same_socket(number: int) -> socket.socket:
    """Return another handle of the socket with this file descriptor.

    Raises:
        OSError: It is no socket.
    """
    own = os.dup(number)
    try:
        return socket.socket(fileno=own)
    except OSError:
        os.close(own)
        raise
