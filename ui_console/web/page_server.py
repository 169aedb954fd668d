"""Server of pages: files over HTTP, messages over WebSockets; an application interprets the messages."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sized
from contextlib import asynccontextmanager
from ssl import SSLContext
from typing import Any, Generic, Protocol, TypeVar, cast

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from backbone.errors import Refusal
from backbone.spoken import counted
from ui_console.web.login import (
    MAX_MESSAGE_BYTES,
    Authenticator,
    BeatRequest,
    ClientSession,
    Hello,
    IntentT,
    ProtocolViolation,
    ViolationKind,
    Welcome,
)
from ui_console.web.page_client import PageClient
from ui_console.web.page_files import SOCKET_PATH, Answer, PageFiles, is_own_page
from ui_console.web.pending_connections import CLOSE_WITHIN_S, OPEN_WITHIN_S, PendingConnections

PING_EVERY_S = 2.0  # chosen: a tablet that goes out of reach releases its robot within 6 s
READ_WITHIN_S = 4.0  # chosen: a page that is delayed for longer is useless for driving
MOST_OPERATORS = 32  # chosen: more browsers than a team has people
MOST_UNREAD = 8  # messages read ahead of the present one
SEND_AHEAD_BYTES = 32768  # a picture and a half in addition to the system's buffer
FATAL_CODES = {
    ViolationKind.OVERSIZED: CloseCode.MESSAGE_TOO_BIG,
    ViolationKind.MALFORMED: CloseCode.INVALID_DATA,
    ViolationKind.SLOW: CloseCode.TRY_AGAIN_LATER,
    ViolationKind.CROWD: CloseCode.TRY_AGAIN_LATER,
}
MOST_REASON = 120  # of the 123 bytes for the reason in a close frame
NOT_SERVED = "this mission is not served any more"
KEEPALIVE_REASON = "keepalive ping timeout"


class CannotListen(Refusal):
    """The address is not free, or not one of this machine."""

    code = "web.address"
    remedy = "Choose another address with --host, or another port with --port."


ClientT = TypeVar("ClientT", bound=PageClient)
HeardT_contra = TypeVar("HeardT_contra", contravariant=True)


class Application(Protocol[ClientT, HeardT_contra]):
    """The application behind a page: the consoles, or the designer."""

    @property
    def clients(self) -> Sized:
        """The connected clients."""

    def enter(self, welcome: Welcome) -> ClientT:
        """Return a new client."""

    async def obey(self, client: ClientT, intent: HeardT_contra) -> None:
        """Carry out a client's intent; until this returns, the server reads no further message of that client."""

    def refused(self, client: ClientT) -> None:
        """Stop the actions of a client whose violation ends its connection."""

    async def leave(self, client: ClientT, reason: str) -> None:
        """Remove a client."""

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the clients a violation."""


class PageServer(Generic[ClientT, IntentT]):
    """Serves a page and its socket.

    Args:
        authenticator: Knows the tokens.
        understand: Decodes the page's messages.
    """

    def __init__(
        self,
        application: Application[ClientT, IntentT],
        authenticator: Authenticator,
        files: PageFiles,
        understand: Callable[[bytes | str], Hello | BeatRequest | IntentT],
    ) -> None:
        self._application, self._authenticator, self._files, self._understand = (
            application,
            authenticator,
            files,
            understand,
        )
        self._pages: dict[tuple[str, str], ServerConnection] = {}
        self._connections: set[ServerConnection] = set()
        self._is_over = False

    @asynccontextmanager
    async def open(self, host: str, port: int, encryption: SSLContext | None = None) -> AsyncIterator[Server]:
        """Accept browsers until the context is left or the server is closed; see ``open_pages``.

        Raises:
            CannotListen: The address is not free, or not one of this machine.
        """
        async with open_pages({"/": self}, host, port, encryption) as server:
            yield server

    async def end(self) -> None:
        """Close the connections of its pages, and stop serving."""
        self._is_over = True
        closing = [connection.close(CloseCode.GOING_AWAY, NOT_SERVED) for connection in self._connections]
        await asyncio.gather(*closing)

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the clients a violation."""
        self._application.report_violation(who, violation)

    def answer(self, connection: ServerConnection, request: Request, path: str) -> Response | None:
        """Return the requested file; None: the request is for the page's socket.

        Args:
            connection: The browser's.
            path: Path relative to this page's path.
        """
        if self._is_over:
            return connection.respond(404, f"{NOT_SERVED}.\n")
        if path.partition("?")[0] != SOCKET_PATH:
            return _response(self._files.answer(path, _header(request, "If-None-Match")))
        if not is_own_page(_header(request, "Origin"), _header(request, "Host")):
            remedy = "Close that page; only this server's own may connect."
            self._application.report_violation(
                _who(connection), ProtocolViolation(ViolationKind.ORIGIN, "shows a page of another site", remedy)
            )
            return connection.respond(403, "A page of another site may not connect.\n")
        return None

    async def meet(self, pending: PendingConnections, connection: ServerConnection) -> None:
        """Serve one connection to its end."""
        self._connections.add(connection)
        try:
            await self._admit(pending, connection)
        finally:
            self._connections.discard(connection)

    async def _admit(self, pending: PendingConnections, connection: ServerConnection) -> None:
        session = ClientSession(self._authenticator, self._understand, _now_s())
        welcome = await self._wait_welcome(connection, session)
        if welcome is None:
            return
        if len(self._application.clients) >= MOST_OPERATORS:
            line = f"found {counted(len(self._application.clients), 'client')} there, which is the most"
            await self._refuse(
                connection, welcome.user, ProtocolViolation(ViolationKind.CROWD, line, "Close some pages.")
            )
            return
        pending.admit(connection)
        await self._serve(connection, session, welcome)

    async def _wait_welcome(self, connection: ServerConnection, session: ClientSession[IntentT]) -> Welcome | None:
        try:
            async with asyncio.timeout_at(session.must_log_in_by_s):
                said = session.heard(await connection.recv(), _now_s())
        except TimeoutError:
            said = session.late()
        except ConnectionClosed as closed:
            if _was_oversized(closed):
                self._application.report_violation(_who(connection), session.oversized())
            return None
        if isinstance(said, Welcome):
            return said
        if isinstance(said, ProtocolViolation):
            await self._refuse(connection, _who(connection), said)
        return None

    async def _serve(self, connection: ServerConnection, session: ClientSession[IntentT], welcome: Welcome) -> None:
        self._end_earlier(connection, welcome)
        client = self._application.enter(welcome)
        who = f"{welcome.user} at {_who(connection)}"
        writing = asyncio.create_task(self._write(connection, session, client, who), name=f"web: to {who}")
        reason = "the browser has gone away"
        try:
            reason = await self._read(connection, session, client, who)
        finally:
            writing.cancel()
            await self._application.leave(client, reason)
            await asyncio.wait({writing})
            if self._pages.get((welcome.user, welcome.page)) is connection:
                del self._pages[welcome.user, welcome.page]
        if not writing.cancelled():
            writing.result()

    def _end_earlier(self, connection: ServerConnection, welcome: Welcome) -> None:
        """Close an earlier connection of the same page after a broken link, because it may still hold a robot."""
        if not welcome.page:
            return
        earlier = self._pages.get((welcome.user, welcome.page))
        self._pages[welcome.user, welcome.page] = connection
        if earlier is not None:
            earlier.transport.abort()

    async def _read(
        self, connection: ServerConnection, session: ClientSession[IntentT], client: ClientT, who: str
    ) -> str:
        """Carry out the browser's messages until the connection ends; return the reason of its end."""
        while True:
            try:
                data = await connection.recv()
            except ConnectionClosed as closed:
                return self._farewell(session, closed, who)
            said = session.heard(data, _now_s())
            match said:
                case ProtocolViolation():
                    if said.is_fatal:
                        self._application.refused(client)
                    await self._refuse(connection, who, said)
                    if said.is_fatal:
                        return said.line
                case BeatRequest(number):
                    client.put("beat", str(number).encode())
                case Welcome() | None:
                    continue
                case _:
                    await self._application.obey(client, said)

    def _farewell(self, session: ClientSession[IntentT], closed: ConnectionClosed, who: str) -> str:
        if _was_oversized(closed):
            violation = session.oversized()
        elif closed.sent is not None and closed.sent.reason == KEEPALIVE_REASON:
            violation = session.slow(READ_WITHIN_S)
        else:
            return "the browser has gone away"
        self._application.report_violation(who, violation)
        return violation.line

    async def _write(
        self, connection: ServerConnection, session: ClientSession[IntentT], client: ClientT, who: str
    ) -> None:
        """Send the newest content whenever the browser reads; disconnect a browser that does not read."""
        outbox, news = client.outbox, client.news
        try:
            while True:
                news.clear()
                message = outbox.next(_now_s())
                if message is None:
                    await _wait_news(news, outbox.next_s())
                    continue
                async with asyncio.timeout(READ_WITHIN_S):
                    await connection.send(message)
        except TimeoutError:
            self._application.report_violation(who, session.slow(READ_WITHIN_S))
            connection.transport.abort()
        except ConnectionClosed:
            return

    async def _refuse(self, connection: ServerConnection, who: str, violation: ProtocolViolation) -> None:
        self._application.report_violation(who, violation)
        if violation.is_fatal:
            code = FATAL_CODES.get(violation.kind, CloseCode.POLICY_VIOLATION)
            await connection.close(code, f"This page {violation.line}. {violation.remedy}"[:MOST_REASON])


@asynccontextmanager
async def open_pages(
    pages: Mapping[str, PageServer[Any, Any]], host: str, port: int, encryption: SSLContext | None = None
) -> AsyncIterator[Server]:
    """Accept browsers of several pages at one address, until the context is left or the server is closed.

    Args:
        pages: Path of each page; a path ends with a slash, and none begins with another one.
        host: Address to listen at.
        port: Port; 0: any that is free.
        encryption: See ``encryption_with``; None: plain HTTP.

    Raises:
        CannotListen: The address is not free, or not one of this machine.
    """

    def report(who: str, violation: ProtocolViolation) -> None:
        for page in pages.values():
            page.report_violation(who, violation)

    def of(request: Request) -> tuple[PageServer[Any, Any], str] | None:
        found = ((page, request.path[len(at) - 1 :]) for at, page in pages.items() if request.path.startswith(at))
        return next(found, None)

    def answer(connection: ServerConnection, request: Request) -> Response | None:
        pending.asked(connection)
        found = of(request)
        if found is None:
            return connection.respond(404, "There is no such page. Open an address that serve printed.\n")
        return found[0].answer(connection, request, found[1])

    async def meet(connection: ServerConnection) -> None:
        found = of(connection.request) if connection.request is not None else None
        if found is not None:
            await found[0].meet(pending, connection)

    pending = PendingConnections(encryption, report)
    async with await _listen(meet, answer, pending, host, port) as server:
        try:
            yield server
        finally:
            server.close()
            pending.close()


async def _listen(
    meet: Callable[[ServerConnection], Awaitable[None]],
    answer: Callable[[ServerConnection, Request], Response | None],
    pending: PendingConnections,
    host: str,
    port: int,
) -> Server:
    try:
        return await serve(
            meet,
            host,
            port,
            process_request=answer,
            create_connection=cast(Any, pending.new_protocol),
            compression=None,
            server_header=None,
            open_timeout=OPEN_WITHIN_S,
            ping_interval=PING_EVERY_S,
            ping_timeout=READ_WITHIN_S,
            close_timeout=CLOSE_WITHIN_S,
            max_size=MAX_MESSAGE_BYTES,
            max_queue=MOST_UNREAD,
            write_limit=SEND_AHEAD_BYTES,
        )
    except (OSError, UnicodeError) as error:  # the latter by a host like 192.168..1
        reason = getattr(error, "strerror", None) or error
        raise CannotListen(f"cannot listen at {host}:{port}: {reason}") from error


def port_of(server: Server) -> int:
    """Return the port that the server listens at."""
    port: int = next(iter(server.sockets)).getsockname()[1]
    return port


async def _wait_news(news: asyncio.Event, until_s: float | None) -> None:
    """Wait until there is news, or until this machine time."""
    try:
        async with asyncio.timeout_at(until_s):
            await news.wait()
    except TimeoutError:
        return


def _was_oversized(closed: ConnectionClosed) -> bool:
    return closed.sent is not None and closed.sent.code == CloseCode.MESSAGE_TOO_BIG


def _who(connection: ServerConnection) -> str:
    peer = connection.remote_address
    return str(peer[0]) if peer else "an unknown address"


def _header(request: Request, name: str) -> str:
    """Return a header; one that a client repeats is one list (RFC 9110, 5.2), which is no host and no origin."""
    return ", ".join(request.headers.get_all(name))


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _response(answer: Answer) -> Response:
    headers = Headers({**answer.headers, "Content-Length": str(len(answer.body)), "Connection": "close"})
    return Response(
        answer.status, {200: "OK", 304: "Not Modified", 404: "Not Found"}[answer.status], headers, answer.body
    )
