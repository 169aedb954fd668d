"""Logs of components: one file each in the mission's folder, which stays small whatever is said.

A process's standard output and errors are its log file, so that what the interpreter and C libraries say when they die
is in it too. Therefore the file is kept small from outside the writers: when it has grown beyond ``LOG_BYTES`` it
becomes ``NAME.log.1``, in place of an older one, and the process's own descriptors are turned to a new file.

Every process that writes into a log holds it locked, so that whoever starts next can tell the logs of the living from
those of the dead: of the dead the newest ``ENDED_KEPT`` stay. What cannot be written is lost and ends nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import logging
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from backbone.atomic_file import is_at, write_all
from backbone.component.repeats import Repeats
from backbone.printable import printable_lines

LOG_BYTES = 1 << 20  # chosen: a day of an honest component; with the one before it, two
LINE_BYTES = 8192  # chosen: a long traceback; more is a message that somebody else wrote
LOOK_EVERY_BYTES = LOG_BYTES // 16
LOOK_EVERY_S = 5.0  # chosen: also what a C library says is seen; it writes some megabytes meanwhile at worst
ENDED_KEPT = 32  # chosen: of consoles that came and went; more than a person looks into
FOLDER_BYTES = 64 << 20  # chosen: a mission of 30 components that all say as much as they may
TIDY_EVERY_S = 10.0  # chosen: a mission of 400 components starts in less, and is looked through once
_TIDIED = ".tidied"
_OLD = ".1"


def log_path(run_directory: str, name: str) -> Path:
    """Return where a component's output goes."""
    return Path(run_directory) / "log" / f"{name}.log"


def open_log(run_directory: str, name: str) -> int:
    """Return a descriptor that output can go to: of the component's log if there can be one, else of nothing."""
    path = log_path(run_directory, name)
    with contextlib.suppress(OSError):
        tidy(path.parent)
    try:
        return _open(path)
    except OSError:  # the disk is full; or the mission ends just now and its folder is gone: do not bring it back
        return os.open(os.devnull, os.O_WRONLY)


def redirect(run_directory: str, name: str) -> None:
    """Turn standard input to nothing, output and errors to the component's log while the mission has a folder."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    if run_directory:
        _turn_output_to(open_log(run_directory, name))


class ComponentLog(logging.Handler):
    """Writes what is logged in this process to standard error, and keeps the file behind that small.

    Args:
        name: Of the component, in each line.
        run_directory: As for ``redirect``; if that was not called, standard error is left as it is.
    """

    def __init__(self, name: str, run_directory: str = "") -> None:
        super().__init__()
        self.setFormatter(logging.Formatter(f"%(asctime)s %(levelname)s {name} %(name)s: %(message)s"))
        path = log_path(run_directory, name)
        self._path = path if run_directory and is_at(2, path) else None
        self._repeats = Repeats()
        self._unlooked_bytes = 0

    def install(self) -> None:
        """Have all loggers of this process write here only, from the level in ``SCOUT_LOG`` on."""
        logging.basicConfig(level=os.environ.get("SCOUT_LOG", "INFO"), handlers=[self], force=True)

    def watch(self, loop: asyncio.AbstractEventLoop) -> None:
        """Look after the file every few seconds for as long as the loop runs."""
        self.look_after()
        loop.call_later(LOOK_EVERY_S, self.watch, loop)

    def emit(self, record: logging.LogRecord) -> None:
        """Write the record, or count it."""
        try:
            now_s = time.monotonic()
            self._tell(self._repeats.due(now_s))
            if self._repeats.is_new((record.pathname, record.lineno), record.getMessage(), now_s):
                self._write(self.format(record))
        except Exception:
            self.handleError(record)

    def look_after(self) -> None:
        """Tell what was counted, and begin a new file if this one has grown too big."""
        with self.lock or contextlib.nullcontext():
            self._tell(self._repeats.due(time.monotonic()))
            self._keep_small()

    def close(self) -> None:
        """Tell what was counted; called at the end of the process."""
        self._tell(self._repeats.rest())
        super().close()

    def _tell(self, lines: list[str]) -> None:
        for line in lines:
            self._write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {line}")

    def _write(self, text: str) -> None:
        line = printable_lines(text, LINE_BYTES).encode()
        if len(line) > LINE_BYTES:
            line = line[:LINE_BYTES] + f"... ({len(line)} bytes)".encode()
        with contextlib.suppress(OSError):  # a full disk: the line is lost
            sys.stderr.flush()
            write_all(2, line + b"\n")
        self._unlooked_bytes += len(line)
        if self._unlooked_bytes >= LOOK_EVERY_BYTES:
            self._keep_small()

    def _keep_small(self) -> None:
        self._unlooked_bytes = 0
        if self._path is None:
            return
        with contextlib.suppress(OSError):  # the folder is gone, or the disk is full: what grows is tried again
            if os.fstat(2).st_size <= LOG_BYTES:
                return
            if is_at(2, self._path):
                os.replace(self._path, f"{self._path}{_OLD}")
            elif not self._path.exists():  # somebody removed it
                os.ftruncate(2, 0)
                return
            try:
                _turn_output_to(_open(self._path))
            except OSError:
                os.ftruncate(2, 0)
                raise


def tidy(folder: Path, now_s: float | None = None) -> None:
    """Remove the oldest logs of components that have ended, if there are too many or they are too big together.

    Args:
        folder: Of the logs; looked through at most every ``TIDY_EVERY_S``.
        now_s: Time of day; None: now.

    Raises:
        OSError: The folder is gone, or refuses.
    """
    now_s = time.time() if now_s is None else now_s
    mark = folder / _TIDIED
    if mark.exists() and abs(now_s - mark.stat().st_mtime) < TIDY_EVERY_S:
        return
    mark.touch()
    os.utime(mark, (now_s, now_s))
    ended = [path for _, path, _ in sorted(_logs(folder)) if path.suffix == ".log" and not _is_held(path)]
    for path in ended[:-ENDED_KEPT]:
        _remove_ended(path)
        _remove_ended(path.with_name(path.name + _OLD))
    oldest_first = sorted(_logs(folder))
    total = sum(size for _, _, size in oldest_first)
    for _, path, size in oldest_first:
        if total > FOLDER_BYTES and _remove_ended(path):
            total -= size


def _logs(folder: Path) -> Iterator[tuple[float, Path, int]]:
    """Yield each log after the time of its last line, and its size."""
    for path in folder.iterdir():
        if path.name != _TIDIED:
            with contextlib.suppress(FileNotFoundError):  # another process tidies too
                found = path.stat()
                yield found.st_mtime, path, found.st_size


def _is_held(path: Path) -> bool:
    """Say whether a living process writes into it."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except FileNotFoundError:
        return False
    return False


def _remove_ended(path: Path) -> bool:
    """Remove the log unless a living process writes into it; return whether it is gone."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if is_at(file.fileno(), path):
                path.unlink()
    except FileNotFoundError:
        return True
    except BlockingIOError:
        return False
    return True


def _open(path: Path) -> int:
    """Return a descriptor of the file at this path that adds to its end, held by this process among others."""
    while True:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            if is_at(descriptor, path):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # it was removed or replaced before we held it


def _turn_output_to(descriptor: int) -> None:
    """Have standard output and errors go there; the descriptor is used up."""
    with contextlib.suppress(OSError, ValueError):  # a full disk, or a stream that was closed
        sys.stdout.flush()
        sys.stderr.flush()
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    os.close(descriptor)
