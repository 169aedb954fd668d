"""A recording that a command reads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from backbone.command_line.unusable_file import unreadable
from backbone.errors import Refusal
from backbone.operating_system.ending_signals import interruptible
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recording, open_file


class NothingSelected(Refusal):
    """A recording has no message with one of these keys."""

    code = "recording.no_message"
    remedy = "See 'scout-backbone recording keys FILE' for the keys of a recording."


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
        yield Recording(file)


def require_selected(recording: Recording, path: Path, keys: tuple[str, ...]) -> None:
    """Return if no keys are given, or a message of the recording has one of them, else raise.

    Raises:
        NothingSelected: None has one.
    """
    if keys and not any(is_meant(one.key, keys) for one in recording.contents().counts):
        raise NothingSelected(f"{path} has no message whose key matches {' or '.join(keys)}")
