"""The place before the door: connections are known here from their first moment, long before they say anything.

What lies between (encryption, the request, the token) has a deadline as a whole; who is still here then, or whose
place a newcomer takes, is cut off. ``Strangers`` decides whose.
"""

from __future__ import annotations

import asyncio
from asyncio.sslproto import SSLProtocol
from collections.abc import Callable
from ssl import SSLContext
from typing import Any, cast

from websockets.asyncio.server import ServerConnection

from ui_console.web.door import LOGIN_WITHIN_S, Fault, Offence
from ui_console.web.strangers import Strangers

OPEN_WITHIN_S = 5.0  # chosen: a request is a few lines
STRANGER_WITHIN_S = 2 * OPEN_WITHIN_S + LOGIN_WITHIN_S + 1.0  # encryption, request, token, and a moment to be told
CLOSE_WITHIN_S = 1.0  # chosen: who does not say goodbye is cut off
TOLD_EVERY_S = 10.0  # chosen: a crowd is one piece of news


class Porch:
    """Has the connections of those who have shown no token yet.

    Args:
        encryption: What they must speak; None: plain HTTP.
        offended: Told of an address whose strangers were cut off for newcomers.
    """

    def __init__(self, encryption: SSLContext | None, offended: Callable[[str, Offence], None]) -> None:
        self.encryption = encryption
        self._offended = offended
        self._strangers: Strangers[Gate] = Strangers()
        self._gates: dict[ServerConnection, Gate] = {}
        self._displaced, self._told_s = 0, -TOLD_EVERY_S

    def gate(self, *given: Any, **options: Any) -> Gate:
        """Return what a new connection talks to; takes what a ``ServerConnection`` takes."""
        connection = ServerConnection(*given, **options)
        gate = self._gates[connection] = Gate(self, connection)
        return gate

    def came(self, gate: Gate, address: str) -> None:
        """Have room for a new connection."""
        displaced = self._strangers.came(gate, address)
        if displaced is not None:
            displaced.abort()
            self._tell_displaced(displaced.address)

    def asked(self, connection: ServerConnection) -> None:
        """Note that a connection has made a request."""
        self._strangers.asked(self._gates[connection])

    def admit(self, connection: ServerConnection) -> None:
        """Let a connection in: it is no stranger any more, and no newcomer takes its place."""
        gate = self._gates[connection]
        gate.be_known()
        self._strangers.gone(gate)

    def left(self, gate: Gate) -> None:
        """Forget a connection that has ended."""
        self._strangers.gone(gate)
        self._gates.pop(gate.connection, None)

    def close(self) -> None:
        """Cut off all strangers."""
        for gate in list(self._gates.values()):
            if not gate.is_known:
                gate.abort()

    def _tell_displaced(self, address: str) -> None:
        self._displaced += 1
        now_s = asyncio.get_running_loop().time()
        if now_s >= self._told_s + TOLD_EVERY_S:
            line = f"was cut off for a newcomer: {self._displaced} without a token so far, too many at a time"
            self._told_s = now_s
            self._offended(address, Offence(Fault.CROWD, line, "Find out who connects there and sends no token."))


class Gate(asyncio.Protocol):
    """One connection: decrypts it if it is to be encrypted, and hands all on.

    It has the plain transport from the beginning, so that also who never ends the handshake can be cut off; a server
    that asyncio encrypts learns of a connection only after it.

    Attributes:
        connection: Whom it hands on to.
        address: Where the other side is.
        is_known: True once the right token was shown.
    """

    def __init__(self, porch: Porch, connection: ServerConnection) -> None:
        self.connection, self.address, self.is_known = connection, "", False
        self._porch = porch
        self._next: ServerConnection | SSLProtocol = connection
        self._transport: asyncio.Transport | None = None
        self._deadline: asyncio.TimerHandle | None = None

    def be_known(self) -> None:
        """Let it stay for as long as it likes."""
        self.is_known = True
        if self._deadline is not None:
            self._deadline.cancel()

    def abort(self) -> None:
        """Cut it off."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Find room."""
        loop = asyncio.get_running_loop()
        self._transport = cast(asyncio.Transport, transport)
        self.address = str((transport.get_extra_info("peername") or ("",))[0])
        self._deadline = loop.call_later(STRANGER_WITHIN_S, self.abort)
        if self._porch.encryption is not None:
            self._next = SSLProtocol(
                loop,
                self.connection,
                self._porch.encryption,
                cast(Any, None),  # nobody waits for the handshake
                server_side=True,
                ssl_handshake_timeout=int(OPEN_WITHIN_S),
                ssl_shutdown_timeout=int(CLOSE_WITHIN_S),
            )
        self._porch.came(self, self.address)
        self._next.connection_made(self._transport)

    def data_received(self, data: bytes) -> None:
        """Hand on."""
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
        """Hand on."""
        return self._next.eof_received()

    def pause_writing(self) -> None:
        """Hand on."""
        self._next.pause_writing()

    def resume_writing(self) -> None:
        """Hand on."""
        self._next.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave."""
        if self._deadline is not None:
            self._deadline.cancel()
        self._porch.left(self)
        self._next.connection_lost(exc)
