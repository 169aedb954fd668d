"""The commands that serve pages: the console of a mission that is up, and the addresses with tokens."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from ssl import SSLContext

import msgspec

from backbone.bus.interface import Bus
from backbone.command_line.where import Where
from backbone.component.launch import Launch
from backbone.launcher.endings import ExitCode, say
from ui_console.session.joining import end_server_on_signals, join, write_line
from ui_console.web.encryption import encryption_with
from ui_console.web.hub import WebHub
from ui_console.web.login import Authenticator, TokenRights
from ui_console.web.page_server import CannotListen
from ui_console.web.server import WebServer
from ui_console.web.token_file import TokenFile, TokensNotKept, kept_or_new

LOOPBACK = ("127.0.0.1", "::1", "localhost")
ANYWHERE = ("0.0.0.0", "::", "")  # noqa: S104  only compared with what the operator said


@dataclass(frozen=True)
class ServerOptions:
    """Address and encryption of a served page.

    Attributes:
        host: Address to listen at.
        port: Port; 0: any that is free.
        certificate: PEM file; empty: the page is not encrypted.
        key: PEM file with its key; empty: it is in the certificate's file.
        has_new_tokens: True: tokens of the server before at this port are forgotten.
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
        """Return the valid tokens: the tokens of the server before, if they are kept and wanted, else the new ones."""
        return rights if tokens is None or self.has_new_tokens else kept_or_new(rights, tokens.read())

    def opened(self, port: int, tokens: TokenFile | None, rights: Mapping[str, TokenRights]) -> None:
        """Keep the tokens for the next server, and print the page's address for each.

        Args:
            port: The server listens there.
            tokens: The file that keeps the tokens; None: none does.
            rights: Token → its rights.
        """
        _keep(tokens, rights)
        scheme = "https" if self.certificate else "http"
        for token, granted in rights.items():
            who = f"{granted.user}: " if granted.user else ""
            write_line(f"{who}{scheme}://{_shown(self.host)}:{port}/#token={token}".encode())
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


async def serve_console(where: Where, rights: Mapping[str, TokenRights], options: ServerOptions, claims: Claims) -> int:
    """Serve the console until a signal ends it; return the command's exit code.

    Args:
        where: The mission.
        rights: Token → its rights.
        options: Address and encryption.
        claims: Claims of the operators.

    Raises:
        CannotListen: The address is not free, or not one of this machine.
        NoCertificate: The certificate or its key is missing or not valid.
    """
    encryption = options.encryption
    joining = await join(where)
    launch = msgspec.structs.replace(joining.launch, name=f"web-{os.getpid()}")
    tokens = _tokens_of_mission(where, launch.mission, joining.secret, options.port)
    rights = options.rights_with(tokens, rights)

    async def one_more(launch: Launch) -> Bus:
        return await joining.open_bus(launch)

    bus = await one_more(launch)
    hub = WebHub(launch, bus, joining.clock, one_more, kind=claims.kind, away_after_s=claims.away_after_s)
    interrupted = end_server_on_signals(hub.observer.end)
    server = WebServer(hub, Authenticator(rights))
    try:
        await server.run(options.host, options.port, lambda port: options.opened(port, tokens, rights), encryption)
    except CannotListen:
        await bus.close()
        raise
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


def _tokens_of_mission(where: Where, mission: str, secret: str, port: int) -> TokenFile | None:
    """Return the file that keeps the tokens of a console's page; None: none does, see ``token_file``."""
    if not port:
        return None
    if where.connect is None:
        return TokenFile.of_mission_here(mission, port)
    return TokenFile.of_mission_elsewhere(mission, where.connect, secret, port)


def _keep(tokens: TokenFile | None, rights: Mapping[str, TokenRights]) -> None:
    """Keep the tokens for the next server, so that open pages come back; a failure is printed, and serving goes on."""
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
