"""The commands that serve pages: the console of a mission that is up, and the addresses that let people in."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from ssl import SSLContext

import msgspec

from backbone import run_files
from backbone.bus.interface import Bus
from backbone.cli import ExitCode, say
from backbone.component.launch import Launch
from ui_console.joining import Where, end_server_on_signals, join, write_line
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
    """

    host: str
    port: int
    certificate: str
    key: str

    @property
    def encryption(self) -> SSLContext | None:
        """What is encrypted with; None: nothing is.

        Raises:
            NoCertificate: There is none where one should be.
        """
        return encryption_with(self.certificate, self.key) if self.certificate else None

    def print_addresses(self, port: int, passes: Mapping[str, Pass]) -> None:
        """Print the page's address for each token.

        Args:
            port: At which browsers can come.
            passes: Token → whose it is.
        """
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


async def serve_console(
    where: Where, passes: Mapping[str, Pass], site: Site, claims: Claims, *, has_new_tokens: bool
) -> int:
    """Serve the console until a signal ends it; return the command's exit code.

    Args:
        where: The mission.
        passes: Token → whose it is.
        site: Where it is served.
        claims: What operators claim.
        has_new_tokens: Whether the tokens of the server before at this port are forgotten.

    Raises:
        CannotListen: The address cannot be had.
        NoCertificate: There is none where one should be.
    """
    encryption = site.encryption
    joining = await join(where)
    launch = msgspec.structs.replace(joining.launch, name=f"web-{os.getpid()}")
    tokens = _token_file(launch.mission, site) if where.connect is None else None
    if tokens is not None and not has_new_tokens:
        passes = kept_or_new(passes, tokens.read())

    async def one_more(launch: Launch) -> Bus:
        return await joining.open_bus(launch)

    bus = await one_more(launch)
    hub = WebHub(launch, bus, joining.clock, one_more, kind=claims.kind, away_after_s=claims.away_after_s)
    interrupted = end_server_on_signals(hub.observer.end)

    def ready(port: int) -> None:
        _keep(tokens, passes)
        site.print_addresses(port, passes)

    try:
        await WebServer(hub, Doorkeeper(passes)).run(site.host, site.port, ready, encryption)
    except CannotListen:
        await bus.close()
        raise
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


def _token_file(mission: str, site: Site) -> TokenFile | None:
    """Return where the tokens are kept; None: nowhere, for no open page can come back to a port that nobody chose."""
    return TokenFile(run_files.run_directory(mission), site.port) if site.port else None


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
