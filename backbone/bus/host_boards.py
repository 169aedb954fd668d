"""Boards of one bus: values reach listeners of the same host over a blackboard, never over the network.

A board is named after its key and its sender, so several senders of one key do not disturb each other.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
from collections.abc import Collection
from pathlib import Path

from backbone.blackboard import sealed_memory
from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.sealed_memory import ForeignFolder
from backbone.blackboard.values import NoWriter, WriterStands
from backbone.blackboard.writer import BlackboardWriter
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES

FOLDER = "board"
LARGE_BYTES = 16_384  # chosen: a board is quicker at every size, but costs ten descriptors, and most outputs are small
LOOK_EACH_S = 1.0  # chosen: as for recorders; one check takes some 20 µs

log = logging.getLogger(__name__)


class HostBoards:
    """The boards of one bus. Make it inside a running event loop, and use it there.

    Args:
        directory: Folder of the mission's files on this host.
        neighbors: Senders of this process; their publications need no board.
    """

    def __init__(self, directory: Path, neighbors: Collection[str] = frozenset()) -> None:
        self._directory, self._loop = directory / FOLDER, asyncio.get_running_loop()
        self.neighbors = neighbors

    def board(self, key: str, source: str, least_bytes: int = LARGE_BYTES, *, each: bool = False) -> SentBoard:
        """Return the board of a sender for a key; the first value of at least ``least_bytes`` opens it.

        Args:
            each: True: its readers get each value, not only the newest.
        """
        return SentBoard(self._directory, _name(key, source), self._loop, least_bytes, each=each)

    def look(self, key: str, source: str) -> BlackboardReader | None:
        """Return a new reader of a sender's board; None: it has none on this host."""
        try:
            return BlackboardReader(self._directory, _name(key, source), most_bytes=MAX_LARGE_MESSAGE_BYTES)
        except (NoWriter, ForeignFolder, OSError) as refusal:
            log.debug("no board of %s: %s", source, refusal)
            return None


class SentBoard:
    """The board of one sender for one key, which opens with the first value that is long enough."""

    def __init__(
        self, directory: Path, name: str, loop: asyncio.AbstractEventLoop, least_bytes: int, *, each: bool
    ) -> None:
        self._directory, self._name, self._loop, self._least_bytes = directory, name, loop, least_bytes
        self._each = each
        self._writer: BlackboardWriter | None = None
        self._try_again_s = 0.0

    @property
    def is_open(self) -> bool:
        """Whether listeners of this host can read it."""
        return self._writer is not None

    @property
    def is_read(self) -> bool:
        """Whether a listener of this host reads it."""
        return self._writer is not None and self._writer.has_readers

    def put(self, raw: bytes) -> bool:
        """Put the value on the board; return whether the board was opened for it."""
        is_new = self._writer is None and len(raw) >= self._least_bytes and self._open()
        if self._writer is not None:
            self._writer.keeps = len(raw) > MAX_MESSAGE_BYTES  # too long for the network: later listeners get it, too
            try:
                self._writer.put(raw)
            except OSError as error:  # neither memory nor descriptors are left: listeners use the network
                log.warning("no board on this host for now: %s", error)
                self._try_again_s = self._loop.time() + LOOK_EACH_S
                self.close()
        return is_new and self.is_open

    def close(self) -> None:
        """Close the board for all readers. Idempotent."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def _open(self) -> bool:
        now_s = self._loop.time()
        if now_s < self._try_again_s:
            return False
        try:
            self._writer = BlackboardWriter(
                self._directory, self._name, most_bytes=MAX_LARGE_MESSAGE_BYTES, keeps=False, each=self._each
            )
        except (WriterStands, ForeignFolder, OSError) as refusal:
            log.info("no board on this host: %s", refusal)
            self._try_again_s = now_s + LOOK_EACH_S
            return False
        self._writer.serve_in_loop()
        return True


def boards_for(directory: str, neighbors: Collection[str] = frozenset()) -> HostBoards | None:
    """Return the boards of a bus; None if its launch names no folder, or the system has no sealed memory files."""
    return HostBoards(Path(directory), neighbors) if directory and sealed_memory.IS_POSSIBLE else None


def _name(key: str, source: str) -> str:
    return "b" + hashlib.blake2s(f"{key} {source}".encode(), digest_size=12).hexdigest()
