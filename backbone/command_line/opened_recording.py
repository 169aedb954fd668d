"""A recording that a command reads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from backbone.command_line.unusable_file import unreadable
from backbone.operating_system.ending_signals import interruptible
from backbone.recording.reader import NoRecording, Recording, open_file


@contextmanager
def opened(path: Path) -> Iterator[Recording]:
    """Yield the recording in this file; Ctrl-C ends the block at once, because reading may take minutes.

    Raises:
        FileUnusable: The file cannot be read.
        NoRecording: The file is not a recording, or its recorder was killed.
    """
    try:
        file = open_file(path)
    except OSError as error:
        raise unreadable(path, error) from error
    with file, interruptible():
        try:
            recording = Recording(file)
        except NoRecording as error:
            raise type(error)(f"{path}: {error.detail}", remedy=error.remedy) from error
        yield recording
