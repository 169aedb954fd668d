"""Sockets that a library opened in this process: closing them must not block.

A TCP link of zenoh lingers: its close blocks the thread that closes it until the peer has acknowledged all data, 10 s
at most (zenoh 1.10, ``TCP_LINGER_TIMEOUT``). If a cable is cut, this blocks the few threads through which a hub
receives. Then every component waits, and a session that connects again meanwhile gets a link without messages.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from pathlib import Path

_NO_LINGER = struct.pack("ii", 0, 0)  # the system's default: close returns at once, and the system sends the rest


def close_without_waiting() -> None:
    """Make the close of every present TCP socket of this process return at once."""
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError), _same_socket(int(entry.name)) as same:  # no socket, or closed meanwhile
            if same.family in (socket.AF_INET, socket.AF_INET6) and same.type == socket.SOCK_STREAM:
                same.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_LINGER)


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
