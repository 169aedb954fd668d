"""Settings of a Zenoh session, as plain data: of a client and of a hub. Pure.

Measured settings: clients of one hub, no scouting; a lease of 2 s and small batches, but 24 s and large batches if the
link does not leave the host (docs/decisions/0003-zenoh-settings.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from backbone.authentication import SOCKET, USER

LINK_LEASE_MS = 2000  # chosen: twice the second below which a busy Python loses its own link
HOST_LEASE_MS = 24_000  # chosen: a unix socket cannot be cut, and a creator replaces a hung process after 3 s
HOST_BATCH_BYTES = 65_535  # zenoh 1.10: the most
LINK_BATCH_BYTES = 16_384  # chosen: over 256 kbit/s half a second, so a batch of a picture leaves time for three others
_LINK_QUEUES = dict.fromkeys(("real_time", "interactive_high", "data_high", "data", "data_low", "background"), 8)
"""Batches of each priority: as many bytes as two of 64 KiB, so a burst or a picture finds as much room."""
KEEP_ALIVES = 4  # chosen: in each lease, so that three may be late
RETRY_FIRST_MS, RETRY_MOST_MS, RETRY_FACTOR = 20, 100, 1.5  # chosen: a restarted hub is found within 0.1 s
OPEN_TIMEOUT_MS = 5000  # chosen: a hub that starts on a busy machine listens within this time
WAIT_BEFORE_CLOSE_US = 1_000_000  # chosen: the longest time for which a hung consumer may block a sender
HANDSHAKE_MS = 2000  # chosen: one that is slower has lost packets, and a new one sends them sooner than TCP does
_QUIET = {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
_RETRY = {"period_init_ms": RETRY_FIRST_MS, "period_max_ms": RETRY_MOST_MS, "period_increase_factor": RETRY_FACTOR}


def client_settings(endpoint: str, secret: str = "") -> dict[str, object]:
    """Return the settings of a client of the hub at ``endpoint``.

    On each link, both ends use the smaller batches of the two.

    Args:
        endpoint: Endpoint of the hub.
        secret: Secret that the client proves without sending it; empty: the hub asks for none.
    """
    batch_bytes = HOST_BATCH_BYTES if endpoint.startswith(SOCKET) else LINK_BATCH_BYTES
    return {
        "scouting": _QUIET,
        "transport": _transport(
            [endpoint], batch_bytes, {"usrpwd": {"user": USER, "password": secret}} if secret else {}
        ),
        "mode": "client",
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": OPEN_TIMEOUT_MS,
            "exit_on_failure": True,
            "retry": _RETRY,
        },
    }


def hub_settings(listen: list[str], dictionary_file: str) -> dict[str, object]:
    """Return the settings of a hub that listens at these endpoints.

    Args:
        listen: Its endpoints.
        dictionary_file: Users and secrets of its clients; empty: it authenticates no client.
    """
    return {
        "scouting": {**_QUIET, "delay": 0},
        "transport": _transport(
            listen, HOST_BATCH_BYTES, {"usrpwd": {"dictionary_file": dictionary_file}} if dictionary_file else {}
        ),
        "mode": "router",
        "listen": {"endpoints": listen, "exit_on_failure": True},
    }


def _transport(endpoints: Iterable[str], batch_bytes: int, auth: Mapping[str, object]) -> dict[str, object]:
    is_inside = all(endpoint.startswith(SOCKET) for endpoint in endpoints)
    handshake_ms = HOST_LEASE_MS if is_inside else HANDSHAKE_MS
    return {
        "unicast": {"open_timeout": handshake_ms, "accept_timeout": handshake_ms},
        "link": {
            "tx": {
                "lease": HOST_LEASE_MS if is_inside else LINK_LEASE_MS,
                "keep_alive": KEEP_ALIVES,
                "batch_size": batch_bytes,
                "queue": {
                    "size": {} if is_inside else _LINK_QUEUES,
                    "congestion_control": {"block": {"wait_before_close": WAIT_BEFORE_CLOSE_US}},
                },
            }
        },
        "shared_memory": {"enabled": False},
        "auth": auth,
    }
