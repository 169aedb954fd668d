"""Atomic replacement of a file: a reader finds the whole old or the whole new content, also after a power cut.

A writer first writes the new content beside the file, under a fixed hidden name that it holds locked. A killed writer
leaves this hidden file unlocked; the next writer reuses it, ``remove_leftover`` removes it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from backbone.operating_system.file_locks import lock_alone_nowait

_NO_FOLDER_SYNC = (errno.EINVAL, errno.ENOTSUP)
"""File systems that keep no folders of their own, such as some network shares."""


def replace_file(target: Path, content: bytes, *, is_lasting: bool = True) -> None:
    """Replace the content of a file; the file keeps its mode, a new file gets the usual one.

    Args:
        target: The file; its folder exists.
        is_lasting: True: the new content survives a power cut. False: for files that are useless after one.

    Raises:
        OSError: The system refused, the target is a device, pipe or folder, or another process is writing the file; its
            content is unchanged.
    """
    beside = _beside(target)
    descriptor = _claim(beside, os.O_CREAT)
    try:
        if target.exists():
            mode = target.stat().st_mode
            if not stat.S_ISREG(mode):
                raise OSError(errno.EINVAL, "it is no regular file")
            os.fchmod(descriptor, stat.S_IMODE(mode))
        os.ftruncate(descriptor, 0)
        write_all(descriptor, content)
        if is_lasting:
            os.fsync(descriptor)
        with freed_later(target):
            os.replace(beside, target)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(beside)
        raise
    finally:
        os.close(descriptor)
    if is_lasting:
        _sync_folder(target.parent)


def remove_leftover(target: Path) -> bool:
    """Remove the hidden file of a killed writer; return whether there was one.

    Raises:
        OSError: The hidden file cannot be removed.
    """
    beside = _beside(target)
    try:
        descriptor = _claim(beside, 0)
    except (FileNotFoundError, BlockingIOError):  # no hidden file, or its writer lives
        return False
    try:
        os.unlink(beside)
    finally:
        os.close(descriptor)
    return True


@contextlib.contextmanager
def freed_later(path: Path) -> Iterator[None]:
    """Let a thread free the content of the file that the block removes or replaces.

    The system frees the blocks of a file when its last descriptor is closed. A disk that discards freed blocks at once
    was seen to take 0.7 s for it, in which an event loop does nothing else.
    """
    try:
        old = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:  # there is no such file, or none that can be read
        yield
        return
    try:
        yield
    finally:
        try:
            threading.Thread(target=os.close, args=(old,), name="free blocks", daemon=True).start()
        except RuntimeError:  # the system allows no further thread
            os.close(old)


def write_all(descriptor: int, content: bytes) -> None:
    """Write all of the content; one system call may write only a part.

    Raises:
        OSError: The system refused; a part may have been written.
    """
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


def _beside(target: Path) -> Path:
    if not target.name:  # the root, or the folder of this process
        raise OSError(errno.EINVAL, "it is no regular file")
    return target.with_name(f".{target.name}.saving")


def _claim(path: Path, flags: int) -> int:
    """Open the file with an exclusive lock and return its descriptor.

    Raises:
        BlockingIOError: Another writer holds it.
    """
    return opened_locked(path, os.O_RDWR | os.O_NOFOLLOW | flags, 0o666, lock_alone_nowait)


def opened_locked(path: Path, flags: int, mode: int, lock: Callable[[int], None]) -> int:
    """Open the file that is at this path once it is locked, and return its descriptor.

    Raises:
        BlockingIOError: ``lock`` does not wait, and another process holds the file.
    """
    while True:
        descriptor = os.open(path, os.O_CLOEXEC | flags, mode)
        try:
            lock(descriptor)
            if is_at(descriptor, path):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # before this process held it, its writer had finished, or it was removed or replaced


def is_at(descriptor: int, path: Path) -> bool:
    """Return whether the open file is the one at this path."""
    try:
        there = os.stat(path, follow_symlinks=False)
    except FileNotFoundError:
        return False
    ours = os.fstat(descriptor)
    return (there.st_dev, there.st_ino) == (ours.st_dev, ours.st_ino)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NO_FOLDER_SYNC:
            raise
    finally:
        os.close(descriptor)
