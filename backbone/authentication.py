"""Authentication: the endpoints of a mission's hub, and the secret with which clients authenticate.

On one machine the hub listens on a unix socket in the mission's run folder, which only the mission's user can
enter; no port is open. If a mission has other machines, its hub listens on a TCP port too and asks every client for
the secret in the run folder. Only that file holds the secret: no message, argument or log does
(docs/decisions/0016-endpoints-and-authentication-of-a-hub.md).
"""

from __future__ import annotations

import ipaddress
import os
import re
import shlex
import stat
from pathlib import Path

from backbone.errors import Refusal

SOCKET_NAME, SECRET_NAME = "hub.sock", "secret"
SOCKET = "unixsock-stream/"
"""Prefix of an endpoint that is a unix socket, so its links cannot leave the host."""
ENDS_OF_PATH = "?#"  # begin the metadata and the configuration of a Zenoh endpoint
LONGEST_SOCKET_PATH = 107  # linux/un.h: sun_path has 108 bytes, of which the last one is 0
HUB_PORT = 7447  # Zenoh's own
USER = "scout"  # the one user of today's hubs; certificates will name hosts and people
SECRET_BYTES = 32  # chosen: 256 bits cannot be guessed
OF_OTHERS = stat.S_IRWXG | stat.S_IRWXO  # as ssh(1) says of identity files
LONGEST_SECRET_FILE = 4096  # chosen: a longer file holds no secret


class SocketPathTooLong(Refusal):
    """The path is longer than the system allows for a unix socket."""

    code = "run.socket_path"
    remedy = "Give the mission a shorter name, or set XDG_RUNTIME_DIR to a folder with a shorter path."


class SocketPathCut(Refusal):
    """The path has a character that ends the path of an endpoint."""

    code = "run.socket_path_cut"
    remedy = "Set XDG_RUNTIME_DIR to a folder whose path has no '?' and no '#'."


class NoSecret(Refusal):
    """The secret of a mission with several machines is missing or unreadable."""

    code = "run.secret"
    remedy = "Name a file that holds the mission's secret with --secret-file; 'scout-backbone up' prints its place."


def socket_endpoint(directory: Path) -> str:
    """Return the endpoint of a hub whose files lie in the folder.

    Raises:
        SocketPathTooLong: The path is too long for a socket.
        SocketPathCut: Zenoh would use only a part of the path.
    """
    path = directory.absolute() / SOCKET_NAME
    if cut := next((each for each in str(path) if each in ENDS_OF_PATH), None):
        raise SocketPathCut(f"Zenoh reads the path {path} only up to {cut!r}", path=str(path))
    length = len(os.fsencode(path))
    if length > LONGEST_SOCKET_PATH:
        raise SocketPathTooLong(
            f"{path} has {length} bytes, but at most {LONGEST_SOCKET_PATH} are possible", length=length
        )
    return f"{SOCKET}{path}"


def tcp_endpoint(address: str, port: int) -> str:
    """Return the endpoint at which a hub listens for other machines.

    Example:
        >>> tcp_endpoint("192.0.2.7", 7447), tcp_endpoint("2001:db8::7", 7447)
        ('tcp/192.0.2.7:7447', 'tcp/[2001:db8::7]:7447')
    """
    return f"tcp/[{address}]:{port}" if ":" in address else f"tcp/{address}:{port}"


def is_loopback(address: str) -> bool:
    """Return whether this IP address or name means the machine itself."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def is_reachable(address: str) -> bool:
    """Return whether other machines can reach a machine by this IP address or name.

    Example:
        >>> is_reachable("192.0.2.7"), is_reachable("field.local"), is_reachable("0.0.0.0"), is_reachable("localhost")
        (True, True, False, False)
    """
    try:
        return not is_loopback(address) and not ipaddress.ip_address(address).is_unspecified
    except ValueError:
        return True


def is_of_one_link(address: str) -> bool:
    """Return whether this IP address has a meaning only together with a network interface of one machine.

    Example:
        >>> is_of_one_link("fe80::7"), is_of_one_link("fe80::7%eth0"), is_of_one_link("fd00::7"), is_of_one_link("lab")
        (True, True, False, False)
    """
    return ":" in address and ipaddress.IPv6Address(address).is_link_local


def is_address(text: str) -> bool:
    """Return whether this is an IP address, or a host name that the system would look up.

    Example:
        >>> is_address("192.0.2.7"), is_address("field.local"), is_address("192.0.2.300"), is_address("field..local")
        (True, True, False, False)
    """
    try:
        if ":" in text or re.fullmatch(r"[0-9.]+", text):
            ipaddress.ip_address(text)
        else:
            text.encode("idna")
    except ValueError:
        return False
    return True


def new_secret() -> str:
    """Return a new random secret."""
    return os.urandom(SECRET_BYTES).hex()


def keep_secret(directory: Path, secret: str) -> Path:
    """Write the secret into the folder, readable by this user alone, and return its file.

    The hub uses the same file as its dictionary of users.
    """
    path = directory / SECRET_NAME
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii") as file:
        file.write(f"{USER}:{secret}\n")
    return path


def dictionary_of(directory: str) -> str:
    """Return the dictionary of users for a hub of this folder; empty: the hub authenticates no client."""
    path = Path(directory) / SECRET_NAME
    return str(path) if directory and path.exists() else ""


def secret_of(directory: str) -> str:
    """Return the secret in the folder, empty if the mission has none."""
    try:
        return read_secret((Path(directory) / SECRET_NAME).read_text("ascii")) if directory else ""
    except FileNotFoundError:
        return ""


def read_secret(text: str) -> str:
    """Return the secret in a typed text or the text of a secret file.

    Example:
        >>> read_secret("scout:c0ffee")
        'c0ffee'

    Raises:
        NoSecret: The text holds no secret.
    """
    secret = text.strip().removeprefix(f"{USER}:")
    if not secret or not secret.isascii() or not secret.isprintable() or set(" :") & set(secret):
        raise NoSecret("no secret is in it: it must be one word")
    return secret


def read_secret_file(path: Path) -> str:
    """Return the secret in the file.

    Raises:
        NoSecret: The file holds no secret, cannot be read, or is this account's and open to others, as ssh refuses
            such a key.
    """
    try:
        with path.open(encoding="ascii") as file:
            kept, text = os.fstat(file.fileno()), file.read(LONGEST_SECRET_FILE)
    except (OSError, UnicodeDecodeError) as error:
        raise NoSecret(f"{path}: {error}") from error
    if stat.S_ISREG(kept.st_mode) and kept.st_uid == os.getuid() and kept.st_mode & OF_OTHERS:
        told = f"{path}: other accounts of this machine may read it (mode {stat.S_IMODE(kept.st_mode):03o})"
        raise NoSecret(told, remedy=f"Type: chmod go= {shlex.quote(str(path))}")
    try:
        return read_secret(text)
    except NoSecret as none:
        raise NoSecret(f"{path}: {none.detail}") from None
