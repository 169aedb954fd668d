"""The commands that serve pages: consoles of running missions, and addresses with tokens."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping, Sequence
from contextlib import AsyncExitStack
from dataclasses import dataclass
from ssl import SSLContext

import msgspec

from backbone.bus.interface import Bus
from backbone.command_line.where import Where
from backbone.component.launch import Launch
from backbone.launcher.endings import ExitCode, say
from ui_console.session.joining import Joining, end_server_on_signals, join, write_line
from ui_console.web.encryption import encryption_with
from ui_console.web.hub import WebHub
from ui_console.web.login import Authenticator, TokenRights, new_token
from ui_console.web.server import Console, WebServer, path_of
from ui_console.web.token_file import TokenFile, TokensNotKept, kept_or_new

LOOPBACK = ("127.0.0.1", "::1", "localhost")
ANYWHERE = ("0.0.0.0", "::", "")  # noqa: S104  only compared with the operator's option


@dataclass(frozen=True)
class ServerOptions:
    """Address and encryption of a served page.

    Attributes:
        host: Address to listen at.
        port: Port; 0: any that is free.
        certificate: PEM file; empty: the page is not encrypted.
        key: PEM file with its key; empty: it is in the certificate's file.
        has_new_tokens: True: tokens of the previous server at this port are dropped.
    """

    host: str
    port: int
    certificate: str
    key: str
    has_new_tokens: bool

    @property
    def encryption(self) -> SSLContext | None:
        """TLS context; None: the page is not encrypted.

        Raises:
            NoCertificate: The certificate or its key is missing or not valid.
        """
        return encryption_with(self.certificate, self.key) if self.certificate else None

    def rights_with(self, tokens: TokenFile | None, rights: Mapping[str, TokenRights]) -> Mapping[str, TokenRights]:
        """Return the valid tokens: the previous server's tokens, if they are stored and wanted, else the new ones."""
        return rights if tokens is None or self.has_new_tokens else kept_or_new(rights, tokens.read())

    def opened(self, port: int, tokens: TokenFile | None, rights: Mapping[str, TokenRights], mission: str = "") -> None:
        """Store the tokens for the next server, and print the page's address for each token.

        Args:
            port: Port of the server.
            tokens: The token file; None: tokens are not stored.
            rights: Token → its rights.
            mission: Name of the mission if several are served; empty: there is only one page.
        """
        _keep(tokens, rights)
        scheme = "https" if self.certificate else "http"
        path = path_of(mission, is_alone=not mission)
        for token, granted in rights.items():
            who = ", ".join(filter(None, (mission, granted.user)))
            at = f"{scheme}://{_shown(self.host)}:{port}{path}#token={token}"
            write_line(f"{who}: {at}".encode() if who else at.encode())
        if not mission:
            self.warn_if_readable()

    def warn_if_readable(self) -> None:
        """Print a warning if others on the network can read the pages' messages."""
        if self.host not in LOOPBACK and not self.certificate:
            say(
                "the connection is not encrypted, so others on the network can read its messages: use it on networks "
                "you trust, or give a --certificate"
            )


@dataclass(frozen=True)
class Claims:
    """Claims of the operators of a page.

    Attributes:
        kind: Kind of ARC.
        away_after_s: A console gives its robot back after so long without a touch of its operator; 0: never.
    """

    kind: str
    away_after_s: float


@dataclass(frozen=True)
class _Served:
    console: Console
    tokens: TokenFile | None
    rights: Mapping[str, TokenRights]


async def serve_consoles(
    missions: Sequence[Where], rights: Mapping[str, TokenRights], options: ServerOptions, claims: Claims
) -> int:
    """Serve the consoles of one or several missions until a signal ends it; return the command's exit code.

    Args:
        missions: The missions, with different names.
        rights: Token → its rights in the first mission; in each other one new tokens have the same rights.
        options: Address and encryption.
        claims: Claims of the operators.

    Raises:
        CannotListen: The address is not free, or not one of this machine.
        NoCertificate: The certificate or its key is missing or not valid.
        Refusal: One of the missions is not up on this machine.
        LinkError: The hub of one does not answer.
    """
    encryption = options.encryption
    joinings = [await join(where) for where in missions]
    async with AsyncExitStack() as stack:
        served = list[_Served]()
        for where, joining in zip(missions, joinings, strict=True):
            own = {new_token() if served else token: granted for token, granted in rights.items()}
            served.append(await _console(where, joining, own, options, claims, stack))

        def end(reason: str) -> None:
            for each in served:
                each.console.hub.observer.end(reason)

        def opened(port: int) -> None:
            for each in served:
                mission = each.console.hub.mission if len(served) > 1 else ""
                options.opened(port, each.tokens, each.rights, mission)
            if len(served) > 1:
                options.warn_if_readable()

        interrupted = end_server_on_signals(end)
        await WebServer(*(each.console for each in served)).run(options.host, options.port, opened, encryption)
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


async def _console(
    where: Where,
    joining: Joining,
    rights: Mapping[str, TokenRights],
    options: ServerOptions,
    claims: Claims,
    stack: AsyncExitStack,
) -> _Served:
    """Return the console of one mission; its bus is closed with the stack."""
    launch = msgspec.structs.replace(joining.launch, name=f"web-{os.getpid()}")
    tokens = _tokens_of_mission(where, launch.mission, joining.secret, options.port)
    valid = options.rights_with(tokens, rights)

    async def one_more(launch: Launch) -> Bus:
        return await joining.open_bus(launch)

    bus = await one_more(launch)
    stack.push_async_callback(bus.close)
    hub = WebHub(launch, bus, joining.clock, one_more, kind=claims.kind, away_after_s=claims.away_after_s)
    return _Served(Console(hub, Authenticator(valid)), tokens, valid)


def _tokens_of_mission(where: Where, mission: str, secret: str, port: int) -> TokenFile | None:
    """Return the token file of a console's page; None: tokens are not stored, see ``token_file``."""
    if not port:
        return None
    if where.connect is None:
        return TokenFile.of_mission_here(mission, port)
    return TokenFile.of_mission_elsewhere(mission, where.connect, secret, port)


def _keep(tokens: TokenFile | None, rights: Mapping[str, TokenRights]) -> None:
    """Store the tokens for the next server, so that open pages reconnect; print a failure, and continue."""
    try:
        if tokens is not None:
            tokens.keep(rights)
    except TokensNotKept as refusal:
        say(str(refusal))


def _shown(host: str) -> str:
    """Return the host of the page's address in a browser."""
    if host in ANYWHERE:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
