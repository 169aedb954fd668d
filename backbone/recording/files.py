"""The files of one recording: a further file begins whenever one becomes too long or too large."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import IO

from backbone.atomic_file import freed_later

SPLIT_S = 3_600.0  # chosen: people find an hour by its file name, and the recorder's index of it stays small
SPLIT_BYTES = 1_000_000_000  # chosen: copying it takes seconds


class RecordingFiles:
    """Opens the files, one after the other: ``night.mcap``, ``night-2.mcap``, ``night-3.mcap``.

    Args:
        first: Path of the first file.
        keep: Number of files to keep; before a further file, the oldest is deleted. 0: all are kept.

    Raises:
        FileExistsError: The first file exists.
        OSError: The file cannot be written.
    """

    def __init__(self, first: Path, keep: int = 0) -> None:
        self._first, self._keep = first, keep
        self._kept: deque[Path] = deque()
        self._number = 0
        self.path = first
        """Path of the open file."""
        self.file: IO[bytes] = self._open()

    @property
    def oldest(self) -> Path:
        """Path of the oldest file that is kept, and was not deleted by a person; the open file, if none is left."""
        return next((path for path in self._kept if path.exists()), self.path)

    @property
    def is_deleted(self) -> bool:
        """Whether the open file was deleted; then all that is written to it is lost."""
        return not self.file.closed and os.fstat(self.file.fileno()).st_nlink == 0

    def open_next(self) -> Callable[[], None]:
        """Open the next file; names of existing files are skipped.

        Returns:
            A function that closes the file before, see ``close``. It may take seconds; call it from any thread.

        Raises:
            OSError: The next file cannot be written; the file before stays open.
        """
        before, self.file = self.file, self._open()
        return partial(_close, before)

    def close(self) -> None:
        """Close the file, after its content is on the disc."""
        _close(self.file)

    def _open(self) -> IO[bytes]:
        while True:
            self._number += 1
            self.path = self._named(self._number)
            try:
                opened = self.path.open("xb")
            except FileExistsError:
                if self._number == 1:
                    raise
                continue
            self._kept.append(self.path)
            if self._keep and len(self._kept) > self._keep:
                with freed_later(oldest := self._kept.popleft()):
                    oldest.unlink(missing_ok=True)
            return opened

    def _named(self, number: int) -> Path:
        return self._first if number == 1 else self._first.with_stem(f"{self._first.stem}-{number}")


def _close(file: IO[bytes]) -> None:
    if not file.closed:
        file.flush()
        os.fsync(file.fileno())
        file.close()
