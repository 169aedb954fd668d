"""Logs of components: one file each in the mission's folder, whose size is limited.

The log file is a process's standard output and error, so it also holds the last output of the interpreter and of C
libraries. When the file has grown beyond ``LOG_BYTES``, it is renamed to ``NAME.log.1``, which replaces an older one,
and the process redirects its descriptors to a new file. Log records go through a descriptor of their own, so that a
component may close standard error, and use its number for another file.

Each process holds a lock on its log, so a starting process distinguishes logs of living and of ended components. The
newest ``ENDED_KEPT`` logs of ended components stay. A line that cannot be written is lost; no process ends because of
it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from backbone.atomic_file import freed_later, is_at, opened_locked, write_all
from backbone.component.repeats import Repeats
from backbone.operating_system.file_locks import lock_alone_nowait, lock_together
from backbone.printable_text import printable_lines

LOG_BYTES = 1 << 20  # chosen: a day of an honest component; together with the former file, two days
LINE_BYTES = 8192  # chosen: a long traceback; a longer line quotes a hostile message
LOOK_EVERY_BYTES = LOG_BYTES // 16
LOOK_EVERY_S = 5.0  # chosen: also limits the output of C libraries, which write at most some megabytes in this time
ENDED_KEPT = 32  # chosen: of ended consoles; more than a person reads
FOLDER_BYTES = 64 << 20  # chosen: a mission of 30 components with two full files each
TIDY_EVERY_S = 10.0  # chosen: a mission of 400 components starts in less, and tidies once
_TIDIED = ".tidied"
_OLD = ".1"
_NO_STREAM = (OSError, ValueError, AttributeError)  # a full disk, or a stream that was closed or replaced by None


def log_path(run_directory: str, name: str) -> Path:
    """Return the path of a component's log."""
    return Path(run_directory) / "log" / f"{name}.log"


def open_log(run_directory: str, name: str) -> int:
    """Return a descriptor of the component's log, or of the null device if the log cannot be opened."""
    path = log_path(run_directory, name)
    with contextlib.suppress(OSError):
        tidy(path.parent)
    try:
        return _open(path)
    except OSError:  # the disk is full, or the mission has ended and its folder must not be created again
        return os.open(os.devnull, os.O_WRONLY)


def redirect(run_directory: str, name: str) -> None:
    """Redirect input from the null device, and output to the component's log if the mission has a folder."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    if run_directory:
        _turn_output_to(open_log(run_directory, name), 1, 2)


class ComponentLog(logging.Handler):
    """Writes this process's log records to standard error, and limits the size of the file behind it.

    Args:
        run_directory: As for ``redirect``; without ``redirect``, standard error is not limited.
    """

    def __init__(self, name: str, run_directory: str = "") -> None:
        super().__init__()
        self.setFormatter(logging.Formatter(f"%(asctime)s %(levelname)s {name} %(name)s: %(message)s"))
        path = log_path(run_directory, name)
        self._path = path if run_directory and is_at(2, path) else None
        self._output = 2
        with contextlib.suppress(OSError):  # a command that was started without standard error
            self._output = os.dup(2)
        self._repeats = Repeats()
        self._unlooked_bytes = 0

    def install(self) -> None:
        """Make this the only handler of this process, from the level in ``SCOUT_LOG`` on."""
        logging.basicConfig(level=os.environ.get("SCOUT_LOG", "INFO"), handlers=[self], force=True)

    def watch(self, loop: asyncio.AbstractEventLoop) -> None:
        """Call ``look_after`` every few seconds while the loop runs."""
        self.look_after()
        loop.call_later(LOOK_EVERY_S, self.watch, loop)

    def emit(self, record: logging.LogRecord) -> None:
        """Write the record, or count it if it repeats."""
        try:
            now_s = time.monotonic()
            self._tell(self._repeats.due(now_s))
            if self._repeats.is_new((record.pathname, record.lineno), record.getMessage(), now_s):
                self._write(self.format(record))
        except Exception:
            self.handleError(record)

    def look_after(self) -> None:
        """Write the counts of repeated records, and begin a new file if this one is too big."""
        with self.lock or contextlib.nullcontext():
            self._tell(self._repeats.due(time.monotonic()))
            self._keep_small()

    def close(self) -> None:
        """Write the counts of repeated records; called at the end of the process."""
        self._tell(self._repeats.rest())
        if self._output != 2:
            os.close(self._output)
            self._output = 2
        super().close()

    def _tell(self, lines: list[str]) -> None:
        for line in lines:
            self._write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {line}")

    def _write(self, text: str) -> None:
        line = printable_lines(text, LINE_BYTES).encode()
        if len(line) > LINE_BYTES:
            line = line[:LINE_BYTES] + f"... ({len(line)} bytes)".encode()
        with contextlib.suppress(*_NO_STREAM):
            sys.stderr.flush()
        with contextlib.suppress(OSError):  # a full disk: the line is lost
            write_all(self._output, line + b"\n")
        self._unlooked_bytes += len(line)
        if self._unlooked_bytes >= LOOK_EVERY_BYTES:
            self._keep_small()

    def _keep_small(self) -> None:
        self._unlooked_bytes = 0
        if self._path is None:
            return
        with contextlib.suppress(OSError):  # the folder is gone, or the disk is full: tried again later
            if os.fstat(self._output).st_size <= LOG_BYTES:
                return
            if is_at(self._output, self._path):
                with freed_later(old := self._path.with_name(self._path.name + _OLD)):
                    os.replace(self._path, old)
            elif not self._path.exists():  # the file was removed
                os.ftruncate(self._output, 0)
                return
            try:
                _turn_output_to(_open(self._path), *self._descriptors())
            except OSError:
                os.ftruncate(self._output, 0)
                raise

    def _descriptors(self) -> list[int]:
        """Return the descriptors of this log; the component may have opened a file of its own at 1 or 2."""
        return [one for one in (1, 2) if _is_same(one, self._output)] + [self._output]


def tidy(folder: Path, now_s: float | None = None) -> None:
    """Remove the oldest logs of components that have ended, if there are too many or they are too big together.

    Args:
        folder: Folder of the logs; read at most every ``TIDY_EVERY_S``.
        now_s: Time of day; None: now.

    Raises:
        OSError: The folder is gone, or cannot be read.
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
    """Yield the time of the last line, path and size of each log."""
    for path in folder.iterdir():
        if path.name != _TIDIED:
            with contextlib.suppress(FileNotFoundError):  # another process tidies too
                found = path.stat()
                yield found.st_mtime, path, found.st_size


def _is_held(path: Path) -> bool:
    """Return whether a living process holds the log."""
    try:
        with path.open("rb") as file:
            lock_alone_nowait(file.fileno())
    except BlockingIOError:
        return True
    except FileNotFoundError:
        return False
    return False


def _remove_ended(path: Path) -> bool:
    """Remove the log unless a living process holds it; return whether it is gone."""
    try:
        with path.open("rb") as file:
            lock_alone_nowait(file.fileno())
            if is_at(file.fileno(), path):
                path.unlink()
    except FileNotFoundError:
        return True
    except BlockingIOError:
        return False
    return True


def _open(path: Path) -> int:
    """Open the file for appending with a shared lock and return its descriptor."""
    return opened_locked(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600, lock_together)


def _is_same(one: int, other: int) -> bool:
    """Return whether both descriptors are open at one file."""
    try:
        return os.path.sameopenfile(one, other)
    except OSError:  # the component closed it
        return False


def _turn_output_to(descriptor: int, *outputs: int) -> None:
    """Redirect these descriptors to the descriptor, and close it."""
    with contextlib.suppress(*_NO_STREAM):
        sys.stdout.flush()
        sys.stderr.flush()
    for output in outputs:
        os.dup2(descriptor, output, inheritable=output <= 2)
    os.close(descriptor)
