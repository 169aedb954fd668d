"""Connections before authentication.

Encryption, request and token share one deadline. A connection that misses it, or is displaced by a new one, is closed.
``PendingClients`` decides which one is displaced.
"""

from __future__ import annotations

import asyncio
from asyncio.sslproto import SSLProtocol
from collections.abc import Callable
from ssl import SSLContext
from typing import Any, cast

from websockets.asyncio.server import ServerConnection

from ui_console.web.login import LOGIN_WITHIN_S, ProtocolViolation, ViolationKind
from ui_console.web.pending_clients import PendingClients

OPEN_WITHIN_S = 5.0  # chosen: a request is a few lines
AUTHENTICATED_WITHIN_S = 2 * OPEN_WITHIN_S + LOGIN_WITHIN_S + 1.0  # encryption, request, token, and a moment to refuse
CLOSE_WITHIN_S = 1.0  # chosen: a client that does not complete the closing handshake is disconnected
TOLD_EVERY_S = 10.0  # chosen: many displaced connections make one report


class PendingConnections:
    """The connections before authentication.

    Args:
        encryption: TLS context; None: plain HTTP.
        report_violation: Called with each address whose connections were closed in favor of new ones.
    """

    def __init__(
        self, encryption: SSLContext | None, report_violation: Callable[[str, ProtocolViolation], None]
    ) -> None:
        self.encryption = encryption
        self._report_violation = report_violation
        self._clients: PendingClients[ConnectionProtocol] = PendingClients()
        self._protocols: dict[ServerConnection, ConnectionProtocol] = {}
        self._displaced, self._told_s = 0, -TOLD_EVERY_S

    def new_protocol(self, *given: Any, **options: Any) -> ConnectionProtocol:
        """Return the asyncio protocol of a new connection; takes the arguments of a ``ServerConnection``."""
        connection = ServerConnection(*given, **options)
        protocol = self._protocols[connection] = ConnectionProtocol(self, connection)
        return protocol

    def came(self, protocol: ConnectionProtocol, address: str) -> None:
        """Make room for a new connection."""
        displaced = self._clients.came(protocol, address)
        if displaced is not None:
            displaced.abort()
            self._report_displaced(displaced.address)

    def asked(self, connection: ServerConnection) -> None:
        """Record that a connection has made a request."""
        self._clients.asked(self._protocols[connection])

    def admit(self, connection: ServerConnection) -> None:
        """Admit a connection, so that no new connection can displace it."""
        protocol = self._protocols[connection]
        protocol.be_known()
        self._clients.gone(protocol)

    def left(self, protocol: ConnectionProtocol) -> None:
        """Remove a connection that has ended."""
        self._clients.gone(protocol)
        self._protocols.pop(protocol.connection, None)

    def close(self) -> None:
        """Close all connections before authentication."""
        for protocol in list(self._protocols.values()):
            if not protocol.is_known:
                protocol.abort()

    def _report_displaced(self, address: str) -> None:
        self._displaced += 1
        now_s = asyncio.get_running_loop().time()
        if now_s >= self._told_s + TOLD_EVERY_S:
            line = f"was cut off for a newcomer: {self._displaced} without a token so far, too many at a time"
            self._told_s = now_s
            self._report_violation(
                address, ProtocolViolation(ViolationKind.CROWD, line, "Find out who connects there and sends no token.")
            )


class ConnectionProtocol(asyncio.Protocol):
    """asyncio's protocol of one connection: decrypts it if it is encrypted, and passes all data on.

    It has the plain transport from the beginning, so that a client that never completes the handshake can be
    disconnected. If asyncio did the encryption, the server would get a connection only after the handshake.

    Attributes:
        connection: Receives the data.
        address: Address of the client.
        is_known: True once the client has sent a valid token.
    """

    def __init__(self, pending: PendingConnections, connection: ServerConnection) -> None:
        self.connection, self.address, self.is_known = connection, "", False
        self._pending = pending
        self._next: ServerConnection | SSLProtocol = connection
        self._transport: asyncio.Transport | None = None
        self._deadline: asyncio.TimerHandle | None = None

    def be_known(self) -> None:
        """Remove its deadline."""
        self.is_known = True
        if self._deadline is not None:
            self._deadline.cancel()

    def abort(self) -> None:
        """Disconnect the client."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start the deadline, and make room."""
        loop = asyncio.get_running_loop()
        self._transport = cast(asyncio.Transport, transport)
        self.address = str((transport.get_extra_info("peername") or ("",))[0])
        self._deadline = loop.call_later(AUTHENTICATED_WITHIN_S, self.abort)
        if self._pending.encryption is not None:
            self._next = SSLProtocol(
                loop,
                self.connection,
                self._pending.encryption,
                cast(Any, None),  # no future, because no caller awaits the handshake
                server_side=True,
                ssl_handshake_timeout=int(OPEN_WITHIN_S),
                ssl_shutdown_timeout=int(CLOSE_WITHIN_S),
            )
        self._pending.came(self, self.address)
        self._next.connection_made(self._transport)

    def data_received(self, data: bytes) -> None:
        """Pass it on."""
        if not isinstance(self._next, SSLProtocol):
            self._next.data_received(data)
            return
        rest = memoryview(data)
        while rest:
            room = self._next.get_buffer(len(rest))
            size = min(len(room), len(rest))
            room[:size] = rest[:size]
            self._next.buffer_updated(size)
            rest = rest[size:]

    def eof_received(self) -> bool | None:
        """Pass it on."""
        return self._next.eof_received()

    def pause_writing(self) -> None:
        """Pass it on."""
        self._next.pause_writing()

    def resume_writing(self) -> None:
        """Pass it on."""
        self._next.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the deadline, and pass on."""
        if self._deadline is not None:
            self._deadline.cancel()
        self._pending.left(self)
        self._next.connection_lost(exc)
