"""Sockets of this process that are a library's: their close must not block.

A TCP link of zenoh lingers: its close blocks the thread that closes it until what was sent is acknowledged, 10 s at
most (zenoh 1.10, ``TCP_LINGER_TIMEOUT``). On a cut cable these are the few threads through which a hub receives, so
every component waited for the cable; and a session that came back meanwhile got a link that carried nothing.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from pathlib import Path

_NO_LINGER = struct.pack("ii", 0, 0)  # the default of the system: close returns at once, the rest is sent behind it


def close_without_waiting() -> None:
    """Let every TCP socket that this process has now return from its close at once."""
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
