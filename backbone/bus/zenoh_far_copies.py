"""Copies by network, from processes without a socket to the recorder of their mission.

These are processes of other hosts, consoles elsewhere, and each process until it has found the socket. Other processes
publish no such copies, so the network brings the recorder no message of its own host. Pictures are left out, because
the recorder of their own host has them.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any, Protocol, cast

import zenoh

from backbone.bus import zenoh_outlets
from backbone.bus.host_copies import PICTURES, HostCopies, header_of
from backbone.keys import COPIED, Conversation, key
from backbone.quality import QUALITY

GATHER_S = 0.01  # as ``zenoh_bus.TELL_WITHIN_S``: a crash loses so much
MOST_BYTES = 256 * 1024  # chosen: far more than gathers in 10 ms; a larger amount is published at once


class Copier(Protocol):
    """Sends copies of messages to a recorder."""

    def send(self, key: str, raw: bytes) -> None:
        """Send a copy, or drop it. Never waits."""


class FarCopies:
    """Copies of one session's messages, many in one publication. Make it inside a running event loop."""

    def __init__(self, session: zenoh.Session, mission: str, source: str) -> None:
        self._loop = asyncio.get_running_loop()
        self._waiting, self._waiting_bytes = list[bytes](), 0
        self._is_open, self._is_matched, self._is_new = True, False, False
        self._known_s = self._loop.time() + zenoh_outlets.KNOWN_AFTER_S
        self._publisher = session.declare_publisher(
            key(mission, source, Conversation.FAR), **zenoh_outlets.on_the_wire(QUALITY[Conversation.FAR])
        )

        def changed(status: zenoh.MatchingStatus) -> None:
            self._is_new = self._is_matched = bool(cast("Any", status).matching)  # zenoh's stubs: it is a bool

        self._matching: Any = self._publisher.declare_matching_listener(
            zenoh.handlers.Callback(changed, indirect=False)
        )
        self._is_matched = self._is_matched or bool(cast("Any", self._publisher.matching_status).matching)

    def wants(self, conversation: Conversation) -> bool:
        """Return whether to send copies of this conversation, because a recorder listens.

        A new session does not know its recorder yet. It then copies no outputs, because the next output follows soon.
        It copies all other conversations, because their first message may be the last one for a long time.
        """
        if conversation in PICTURES:
            return False
        return self._is_matched or (conversation is not Conversation.OUTPUTS and self._loop.time() < self._known_s)

    def has_new_listener(self) -> bool:
        """Return whether a recorder has begun to listen since the last call."""
        if not self._is_new:
            return False
        self._is_new = False
        return True

    def send(self, key: str, raw: bytes) -> None:
        """Publish a copy soon, with others."""
        if not self._is_open:
            return
        if not self._waiting:
            self._loop.call_later(GATHER_S, self._publish)
        self._waiting += (header_of(key, raw), raw)
        self._waiting_bytes += len(raw)
        if self._waiting_bytes > MOST_BYTES:
            self._publish()

    def close(self) -> None:
        """Publish the waiting copies, and send no more. Idempotent."""
        self._publish()
        self._is_open = False

    def _publish(self) -> None:
        if self._waiting and self._is_open:
            self._publisher.put(b"".join(self._waiting))
        self._waiting, self._waiting_bytes = [], 0


def copiers(host: HostCopies | None, far: FarCopies | None, conversation: Conversation) -> tuple[Copier, ...]:
    """Return the copiers for a message: none, the recorder of this host, the network, or both."""
    if conversation in COPIED:
        return ()
    if host is not None and far is not None and far.has_new_listener():
        host.look_now()  # its socket may be on this host, and only a socket brings it pictures
    near = host if host is not None and host.find_recorder() else None
    if near is not None and near.reach_mission:
        return (near,)
    other = far if far is not None and far.wants(conversation) else None
    return tuple(one for one in (near, other) if one is not None)


def send_copies(copies: Sequence[Copier], key: str, raw: bytes) -> None:
    """Send a copy of a message by each of these copiers."""
    for copier in copies:
        copier.send(key, raw)
