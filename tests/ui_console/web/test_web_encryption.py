"""HTTPS keeps a page and its socket secret on the way; real sockets on the loopback."""

from __future__ import annotations

import asyncio
import json
import ssl
import urllib.request
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
import trustme
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)
from typer.testing import CliRunner
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidMessage

from backbone.mission.class_facts import ClassFacts
from ui_console.cli import app
from ui_console.design.room import DesignRoom
from ui_console.design.server import DesignServer, begin
from ui_console.web.encryption import NoCertificate, encryption_with
from ui_console.web.login import Authenticator, TokenRights

ANYBODY = "anybody"
WITHIN_S = 15.0


@dataclass(frozen=True)
class Papers:
    """Who vouches for the server, and what the server shows."""

    authority: trustme.CA
    certificate: Path
    key: Path
    both: Path

    def client(self) -> ssl.SSLContext:
        context = ssl.create_default_context()
        self.authority.configure_trust(context)
        return context


@pytest.fixture(scope="module")
def papers(tmp_path_factory: pytest.TempPathFactory) -> Papers:
    folder = tmp_path_factory.mktemp("papers")
    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1", "localhost")
    made = Papers(authority, folder / "certificate.pem", folder / "key.pem", folder / "both.pem")
    issued.cert_chain_pems[0].write_to_path(str(made.certificate))
    issued.private_key_pem.write_to_path(str(made.key))
    issued.private_key_and_cert_chain_pem.write_to_path(str(made.both))
    return made


@pytest.fixture
async def port(papers: Papers, tmp_path: Path) -> AsyncIterator[int]:
    async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
        return {path: ClassFacts("") for path in class_paths}

    draft, kept = begin(str(tmp_path / "guard.xml"))
    server = DesignServer(DesignRoom(draft, kept, look_up), Authenticator({ANYBODY: TokenRights("", 1)}))
    listening: asyncio.Future[int] = asyncio.get_running_loop().create_future()
    end = asyncio.Event()
    encryption = encryption_with(str(papers.certificate), str(papers.key))
    life = asyncio.create_task(server.run("127.0.0.1", 0, listening.set_result, end, encryption))
    try:
        yield await listening
    finally:
        end.set()
        await life


async def wait_welcome(port: int, client: ssl.SSLContext) -> None:
    async with (
        asyncio.timeout(WITHIN_S),
        connect(f"wss://127.0.0.1:{port}/socket", ssl=client, compression=None, proxy=None) as page,
    ):
        await page.send(json.dumps({"do": "hello", "token": ANYBODY, "user": "anna"}))
        while "welcome" not in json.loads(await page.recv()).get("view", {}):
            pass


async def test_the_page_and_its_socket_are_served_to_who_trusts_the_certificate(port: int, papers: Papers) -> None:
    def get() -> bytes:
        address = f"https://127.0.0.1:{port}/"
        with urllib.request.urlopen(address, timeout=WITHIN_S, context=papers.client()) as answer:
            body: bytes = answer.read()
            return body

    assert b"<html" in await asyncio.to_thread(get)
    await wait_welcome(port, papers.client())


async def test_who_does_not_trust_it_does_not_come_in(port: int) -> None:
    with pytest.raises(ssl.SSLCertVerificationError):
        await wait_welcome(port, ssl.create_default_context())


async def test_nobody_is_served_in_the_clear_and_others_do_not_wait_for_who_tries(port: int, papers: Papers) -> None:
    _reader, silent = await asyncio.open_connection("127.0.0.1", port)  # never begins to encrypt
    try:
        with pytest.raises((InvalidMessage, EOFError, ConnectionError)):
            async with connect(f"ws://127.0.0.1:{port}/socket", compression=None, proxy=None):
                pytest.fail("was let in")
        await wait_welcome(port, papers.client())
    finally:
        silent.close()
        await silent.wait_closed()


def test_one_file_may_have_both(papers: Papers) -> None:
    assert encryption_with(str(papers.both), "").minimum_version >= ssl.TLSVersion.TLSv1_2


@pytest.mark.parametrize("what", ["no such file", "no key in it", "no certificate", "another's key", "a password"])
def test_what_cannot_be_served_with_is_refused_with_a_remedy(papers: Papers, tmp_path: Path, what: str) -> None:
    certificate, key = papers.certificate, papers.key
    match what:
        case "no such file":
            certificate = tmp_path / "none.pem"
        case "no key in it":
            key = Path()
        case "no certificate":
            certificate = papers.key
        case "another's key":
            key = tmp_path / "other.pem"
            papers.authority.issue_cert("localhost").private_key_pem.write_to_path(str(key))
        case "a password":
            key = tmp_path / "locked.pem"
            locked = load_pem_private_key(papers.key.read_bytes(), None).private_bytes(
                Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(b"secret")
            )
            key.write_bytes(locked)
    with pytest.raises(NoCertificate, match="cannot serve with") as refused:
        encryption_with(str(certificate), str(key) if key != Path() else "")
    assert "--certificate" in refused.value.remedy


def test_the_command_refuses_it_before_anything_is_served(papers: Papers, tmp_path: Path) -> None:
    words = ["serve", "--design", str(tmp_path / "guard.xml"), "--port", "0"]
    alone = CliRunner().invoke(app, [*words, "--key", str(papers.key)])
    assert alone.exit_code == 2
    assert "--certificate" in alone.stderr
    wrong = CliRunner().invoke(app, [*words, "--certificate", str(tmp_path / "none.pem")])
    assert wrong.exit_code == 5
    assert "web.certificate" in wrong.stderr
    assert wrong.stdout == ""
