"""The refusal of a file that a command cannot use; new files and folders, which exist only if they are complete."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TextIO

from backbone.command_line.standard_streams import HAS_ROOM, NO_ROOM
from backbone.errors import Refusal


class FileUnusable(Refusal):
    """A file of the command cannot be read or written."""

    code = "usage.file"
    remedy = "Name a file that this user may read, or a new file in a folder where this user may write."


@contextmanager
def new_file(path: Path) -> Iterator[IO[bytes]]:
    """Make a file for the output of a command; if the block fails or is interrupted, the file is removed.

    Raises:
        FileUnusable: The file exists, or cannot be written.
    """
    try:
        with path.open("xb") as file:
            try:
                yield file
                file.flush()
            except BaseException:
                path.unlink()
                raise
    except FileExistsError as error:
        raise existing(path) from error
    except OSError as error:
        raise unwritable(path, error) from error


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder for the output of a command, which gets its name when the block has ended.

    If the block fails or is interrupted, the folder is removed. If the process is killed, what is left has a name that
    ends with ``.partial``; so half an output is never taken for a whole one.

    Raises:
        FileUnusable: The folder exists, or a file cannot be written into it.
    """
    try:
        if folder.exists():
            raise FileExistsError
        partial = folder.with_name(f"{folder.name}.{os.getpid()}.partial")
        partial.mkdir(parents=True)
        try:
            yield partial
            partial.rename(folder)
        except BaseException:
            shutil.rmtree(partial, ignore_errors=True)
            raise
    except FileExistsError as error:
        raise FileUnusable(f"{folder} exists", remedy="Name a new folder.") from error
    except OSError as error:
        raise unwritable(folder, error) from error


def open_output(descriptor: int) -> TextIO:
    """Return the file of a descriptor that this process inherited.

    Raises:
        FileUnusable: It is not open for writing.
    """
    try:
        os.write(descriptor, b"")
        return os.fdopen(descriptor, "w", encoding="utf-8")
    except OSError as error:
        raise unwritable(f"descriptor {descriptor}", error) from error


def existing(path: Path) -> FileUnusable:
    """Return the refusal of a new file that exists."""
    return FileUnusable(f"{path} exists", remedy="Name a new file.")


def unreadable(path: Path, error: OSError) -> FileUnusable:
    """Return the refusal of a file that cannot be read."""
    return FileUnusable(f"{path} cannot be read: {error.strerror or error}")


def unwritable(path: Path | str, error: OSError) -> FileUnusable:
    """Return the refusal of a file that cannot be written."""
    remedy = HAS_ROOM if error.errno in NO_ROOM else FileUnusable.remedy
    return FileUnusable(f"{path}: {error.strerror or error}", remedy=remedy)
