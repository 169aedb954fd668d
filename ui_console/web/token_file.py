"""Tokens that outlive the server, readable only by this user.

If a server is restarted at the same port, it accepts the tokens of open pages, which reconnect by themselves. The place
of the file decides when the tokens become invalid:

* A mission on this machine: beside its run files, which are removed with the mission.
* A mission elsewhere: named after its hub and the secret of its run, so that the next run finds none.
* A designer: named after the mission file; removed with the login session.
* Port 0: no file. A page belongs to the port it came from, and no open page finds a port that the system chose.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path

import msgspec

from backbone import run_files
from backbone.atomic_file import replace_file
from backbone.errors import Refusal
from ui_console.web.login import TokenRights

MODE = 0o600
DIGITS = 16  # chosen: 64 bits, unique among one user's missions


class TokensNotKept(Refusal):
    """The tokens cannot be written to the file for the next server."""

    code = "web.tokens"
    remedy = "Free the disk; without that file open pages have to be given the next server's address."


class TokenFile:
    """The tokens of the server at one port.

    Args:
        folder: Folder of the mission's or the user's run files.
        port: Port of the server.
        of: The mission or file served, for a folder with several.
    """

    def __init__(self, folder: Path, port: int, of: str = "") -> None:
        self.path = folder / f"web-{of}{port}.json"

    @classmethod
    def of_mission_here(cls, mission: str, port: int) -> TokenFile:
        """Return the token file of a mission that runs on this machine."""
        return cls(run_files.run_directory(mission), port)

    @classmethod
    def of_mission_elsewhere(cls, mission: str, endpoint: str, secret: str, port: int) -> TokenFile:
        """Return the token file for one run of a mission whose hub is reached over the network."""
        return cls(run_files.kept_directory(), port, _digest(mission, endpoint, secret))

    @classmethod
    def of_design(cls, source: str, port: int) -> TokenFile:
        """Return the token file of the designer of a mission file."""
        return cls(run_files.kept_directory(), port, _digest(str(Path(source).resolve())))

    def read(self) -> dict[str, TokenRights]:
        """Return the previous server's tokens; empty if there are none, or if another user could have read them."""
        try:
            descriptor = os.open(self.path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError:
            return {}
        with os.fdopen(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) != MODE:
                return {}
            try:
                return msgspec.json.decode(file.read(), type=dict[str, TokenRights])
            except (msgspec.DecodeError, UnicodeDecodeError):
                return {}

    def keep(self, rights: Mapping[str, TokenRights]) -> None:
        """Store exactly these tokens for the next server at this port.

        Raises:
            TokensNotKept: The system refused.
        """
        try:
            self.path.touch(mode=MODE)  # the replacing file gets the same mode
            self.path.chmod(MODE)
            replace_file(self.path, msgspec.json.encode(dict(rights)), is_lasting=False)
        except OSError as error:
            raise TokensNotKept(f"{self.path}: {error.strerror or error}", path=str(self.path)) from error


def _digest(*of: str) -> str:
    """Return a short name that is unique to these words and does not reveal them."""
    return f"{hashlib.sha256(json.dumps(of).encode()).hexdigest()[:DIGITS]}-"


def kept_or_new(new: Mapping[str, TokenRights], before: Mapping[str, TokenRights]) -> dict[str, TokenRights]:
    """Return the valid tokens: each operator's previous token, if there was one, else the new one.

    The new server defines the rights of a token. An operator who is not among the new ones loses the token.

    Example:
        >>> kept_or_new({"b": TokenRights("anna", 50)}, {"a": TokenRights("anna", 100), "c": TokenRights("ben", 1)})
        {'a': TokenRights(user='anna', priority=50)}
    """
    tokens = {granted.user: token for token, granted in before.items()}
    return {tokens.get(granted.user, token): granted for token, granted in new.items()}
