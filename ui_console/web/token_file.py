"""Tokens that outlive the server: beside the run files of its mission, for this user alone.

A server that begins again at the same port knows the pages that are still open, and they come back by themselves. The
file ends with the mission.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file
from backbone.errors import Refusal
from ui_console.web.door import Pass

MODE = 0o600


class TokensNotKept(Refusal):
    """The tokens cannot be written where the next server would find them."""

    code = "web.tokens"
    remedy = "Free the disk; without that file open pages have to be told the next server's address."


class TokenFile:
    """The tokens of the server at one port.

    Args:
        folder: Of the mission's run files.
        port: Of the server.
    """

    def __init__(self, folder: Path, port: int) -> None:
        self.path = folder / f"web-{port}.json"

    def read(self) -> dict[str, Pass]:
        """Return the tokens of the server before; none if there was none, or somebody else could have read them."""
        try:
            descriptor = os.open(self.path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError:
            return {}
        with os.fdopen(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) != MODE:
                return {}
            try:
                return msgspec.json.decode(file.read(), type=dict[str, Pass])
            except msgspec.DecodeError:
                return {}

    def keep(self, passes: Mapping[str, Pass]) -> None:
        """Have the next server at this port find these tokens, and no others.

        Raises:
            TokensNotKept: The system refused.
        """
        try:
            self.path.touch(mode=MODE)  # what replaces it has its mode
            self.path.chmod(MODE)
            replace_file(self.path, msgspec.json.encode(dict(passes)), is_lasting=False)
        except OSError as error:
            raise TokensNotKept(f"{self.path}: {error.strerror or error}", path=str(self.path)) from error


def kept_or_new(new: Mapping[str, Pass], before: Mapping[str, Pass]) -> dict[str, Pass]:
    """Return what opens a server: each operator's token of before, if there was one, else the new one.

    What a token is good for is what the new server says. An operator who is not among the new ones has no token any
    more.

    Example:
        >>> kept_or_new({"b": Pass("anna", 50)}, {"a": Pass("anna", 100), "c": Pass("ben", 1)})
        {'a': Pass(user='anna', priority=50)}
    """
    tokens = {granted.user: token for token, granted in before.items()}
    return {tokens.get(granted.user, token): granted for token, granted in new.items()}
