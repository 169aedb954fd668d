"""Ports for tests that must know one before something listens there."""

from __future__ import annotations

import itertools
import os
import socket

FIRST, COUNT = 10_000, 20_000  # chosen: below the ports that a system assigns to connections by itself
STRIDE = 61  # chosen: processes that were started together begin so far apart

_numbers = itertools.count(os.getpid() * STRIDE)


def free_port() -> int:
    """Return a port of this machine at which nothing listens, another one each time.

    A port that the system picks is handed out again as soon as it is let go: to the next test, or to a connection.
    """
    while True:
        port = FIRST + next(_numbers) % COUNT
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                continue
        return port


def free_endpoint() -> str:
    """Return an endpoint for a hub at a free port."""
    return f"tcp/127.0.0.1:{free_port()}"
