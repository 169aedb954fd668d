"""Hosts file: keeps the names of the mission's other hosts for the next placer of the mission.

A host whose link is cut when the placer restarts is in no list; the next placer learns of this host from the file.
"""

from __future__ import annotations

import logging
from pathlib import Path

import msgspec

from backbone.atomic_file import replace_file

log = logging.getLogger(__name__)

FILE_NAME = "other-hosts"
UNREADABLE = "(the file of hosts cannot be read)"
"""In place of the hosts of a file that cannot be read: no host has this name, so it never counts as alive."""


class HostsFile:
    """File of the hosts that had a creator, in the mission's folder.

    Args:
        run_directory: The mission's folder on the placer's host; empty: nothing is kept.
    """

    def __init__(self, run_directory: str) -> None:
        self._path = Path(run_directory) / FILE_NAME if run_directory else None
        self._kept: frozenset[str] = frozenset()

    def read(self) -> frozenset[str]:
        """Return the hosts that an earlier placer saved."""
        if self._path is None:
            return frozenset()
        try:
            self._kept = msgspec.msgpack.decode(self._path.read_bytes(), type=frozenset[str])
        except (FileNotFoundError, NotADirectoryError):
            return frozenset()
        except (OSError, msgspec.DecodeError) as error:
            log.error("%s: %s; starts wait until no silent host can run the component", self._path, error)
            return frozenset({UNREADABLE})
        return self._kept

    def keep(self, host: str) -> None:
        """Save this host, unless it is saved, or raise ``OSError``."""
        if self._path is not None and host not in self._kept:
            self._kept |= {host}
            replace_file(self._path, msgspec.msgpack.encode(self._kept), is_lasting=False)
