"""The commands that serve pages: the console of a mission that is up, and the addresses that let people in."""

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
from ui_console.web.door import Doorkeeper, Pass
from ui_console.web.encryption import encryption_with
from ui_console.web.hub import WebHub
from ui_console.web.reception import CannotListen
from ui_console.web.server import WebServer
from ui_console.web.token_file import TokenFile, TokensNotKept, kept_or_new

LOOPBACK = ("127.0.0.1", "::1", "localhost")
ANYWHERE = ("0.0.0.0", "::", "")  # noqa: S104  only compared with what the operator said


@dataclass(frozen=True)
class Site:
    """Where a page is served.

    Attributes:
        host: Address to listen at.
        port: Port; 0: any that is free.
        certificate: PEM file; empty: the page is not encrypted.
        key: PEM file with its key; empty: it is in the certificate's file.
        has_new_tokens: Whether the tokens of the server before at this port are forgotten.
    """

    host: str
    port: int
    certificate: str
    key: str
    has_new_tokens: bool

    @property
    def encryption(self) -> SSLContext | None:
        """What is encrypted with; None: nothing is.

        Raises:
            NoCertificate: There is none where one should be.
        """
        return encryption_with(self.certificate, self.key) if self.certificate else None

    def passes_with(self, tokens: TokenFile | None, passes: Mapping[str, Pass]) -> Mapping[str, Pass]:
        """Return what opens the server: the tokens of the server before, where they are kept and wanted."""
        return passes if tokens is None or self.has_new_tokens else kept_or_new(passes, tokens.read())

    def opened(self, port: int, tokens: TokenFile | None, passes: Mapping[str, Pass]) -> None:
        """Keep the tokens for the next server, and print the page's address for each.

        Args:
            port: At which browsers can come.
            tokens: Where the tokens are kept; None: nowhere.
            passes: Token → whose it is.
        """
        _keep(tokens, passes)
        scheme = "https" if self.certificate else "http"
        for token, granted in passes.items():
            who = f"{granted.user}: " if granted.user else ""
            write_line(f"{who}{scheme}://{_shown(self.host)}:{port}/#token={token}".encode())
        if self.host not in LOOPBACK and not self.certificate:
            say(
                "whoever can listen on the way to this address can read what is sent: use it on networks you trust, "
                "or give a --certificate"
            )


@dataclass(frozen=True)
class Claims:
    """What the operators of a page claim.

    Attributes:
        kind: Kind of ARC.
        away_after_s: A robot is given back when its operator touched nothing for so long; 0: never.
    """

    kind: str
    away_after_s: float


async def serve_console(where: Where, passes: Mapping[str, Pass], site: Site, claims: Claims) -> int:
    """Serve the console until a signal ends it; return the command's exit code.

    Args:
        where: The mission.
        passes: Token → whose it is.
        site: Where it is served.
        claims: What operators claim.

    Raises:
        CannotListen: The address cannot be had.
        NoCertificate: There is none where one should be.
    """
    encryption = site.encryption
    joining = await join(where)
    launch = msgspec.structs.replace(joining.launch, name=f"web-{os.getpid()}")
    tokens = _tokens_of_mission(where, launch.mission, joining.secret, site.port)
    passes = site.passes_with(tokens, passes)

    async def one_more(launch: Launch) -> Bus:
        return await joining.open_bus(launch)

    bus = await one_more(launch)
    hub = WebHub(launch, bus, joining.clock, one_more, kind=claims.kind, away_after_s=claims.away_after_s)
    interrupted = end_server_on_signals(hub.observer.end)
    server = WebServer(hub, Doorkeeper(passes))
    try:
        await server.run(site.host, site.port, lambda port: site.opened(port, tokens, passes), encryption)
    except CannotListen:
        await bus.close()
        raise
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


def _tokens_of_mission(where: Where, mission: str, secret: str, port: int) -> TokenFile | None:
    """Return where the tokens of a console's page are kept; None: nowhere, see ``token_file``."""
    if not port:
        return None
    if where.connect is None:
        return TokenFile.of_mission_here(mission, port)
    return TokenFile.of_mission_elsewhere(mission, where.connect, secret, port)


def _keep(tokens: TokenFile | None, passes: Mapping[str, Pass]) -> None:
    """Have the next server know the pages that are open; this one serves also if it cannot."""
    try:
        if tokens is not None:
            tokens.keep(passes)
    except TokensNotKept as refusal:
        say(str(refusal))


def _shown(host: str) -> str:
    """Return how a browser names an address that is listened at."""
    if host in ANYWHERE:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
