"""Entries of a host's folder: which process of this host serves an address.

A component that serves an address writes an entry. Askers of the same host read it before they ask the hub, so a slow
or lost link to the hub does not separate them. The entry of a killed process stays until the next process that serves
the address replaces it, or the mission's folder is removed. Until then no process listens at the socket that it names,
and askers ask the hub.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
from pathlib import Path
from typing import NamedTuple

from backbone.atomic_file import replace_file

FOLDER = "line"
LONGEST_ENTRY = 2048  # chosen: bytes; twice the longest key

log = logging.getLogger(__name__)


class Entry(NamedTuple):
    """Where a component of this host takes questions.

    Attributes:
        socket: Name of the socket of its process.
        inbox: Its inbox, which belongs to one run of the component.
    """

    socket: str
    inbox: str


class HostEntries:
    """The entries in one host's folder of a mission.

    Args:
        directory: Folder of the mission's files on this host.
    """

    def __init__(self, directory: Path) -> None:
        self._folder = directory / FOLDER

    def write(self, address: str, entry: Entry) -> None:
        """Replace the entry of an address. If the system refuses, askers of this host ask the hub."""
        try:
            self._folder.mkdir(mode=0o700, exist_ok=True)
            replace_file(self._file(address), "\n".join(entry).encode(), is_lasting=False)
        except OSError as error:
            log.warning("processes of this host ask %s through the hub: %s", address, error)

    def read(self, address: str) -> Entry | None:
        """Return the entry of an address; None: there is none."""
        try:
            with self._file(address).open("rb") as file:
                return Entry(*file.read(LONGEST_ENTRY).decode().split("\n"))
        except (OSError, ValueError, TypeError):  # there is none, or no component wrote it
            return None

    def remove(self, address: str, entry: Entry) -> None:
        """Remove the entry of an address, unless another process has replaced it."""
        if self.read(address) == entry:
            with contextlib.suppress(OSError):  # the mission's folder is being removed
                self._file(address).unlink(missing_ok=True)

    def _file(self, address: str) -> Path:
        """Return the file of an address; a digest names it, because an address may be longer than a file name."""
        return self._folder / hashlib.blake2s(address.encode(), digest_size=12).hexdigest()
