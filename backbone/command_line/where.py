"""Where: the mission that a command's options name, and its secret."""

from __future__ import annotations

import getpass
import sys
from dataclasses import dataclass
from pathlib import Path

from backbone.authentication import read_secret, read_secret_file


@dataclass(frozen=True)
class Where:
    """The mission that a command or a console joins.

    Attributes:
        mission: Name of the mission; None: the one that is up on this machine.
        connect: Endpoint of the hub of a mission elsewhere; such a mission must have a name here.
    """

    mission: str | None
    connect: str | None
    secret_file: Path | None

    def secret(self) -> str:
        """Return the secret of a mission elsewhere; empty for a mission on this machine, because its folder holds it.

        Raises:
            NoSecret: The file or the input holds no secret.
        """
        return read_secret_option(self.secret_file) if self.connect is not None else ""


def read_secret_option(secret_file: Path | None) -> str:
    """Return the secret in the file, or typed without echo for ``-``; empty if no file is named.

    Raises:
        NoSecret: The file or the input holds no secret.
    """
    if secret_file is None:
        return ""
    if str(secret_file) != "-":
        return read_secret_file(secret_file)
    return read_secret(getpass.getpass("secret of the mission: ") if sys.stdin.isatty() else sys.stdin.readline())
