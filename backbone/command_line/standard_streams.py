"""Standard streams of a command: one that is closed, has no room, or cannot show a character ends no command badly."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Iterator

from backbone.launcher.endings import ExitCode, say

_STREAMS = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
HAS_ROOM = "Write it to a disk that has room."
_ONLY_LINES = ("dumb", "unknown")
"""Words of ``TERM`` for terminals that cannot place text, in lower case."""


@contextlib.contextmanager
def standard_streams() -> Iterator[None]:
    """Let the block use all three streams; output that finds no room or no reader ends the process with ``UNEXPECTED``.

    A closed one becomes the null device, because what is opened next would get its number. A character that the
    stream's encoding lacks is shown as an escape.
    """
    _open_closed_ones()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.encoding.lower() != "utf-8":
            stream.reconfigure(errors="backslashreplace")
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        if error.filename is not None or error.errno not in (*NO_ROOM, errno.EPIPE):
            raise
        _drop_output()
        if error.errno != errno.EPIPE:  # a reader that has stopped knows it
            say(f"the output cannot be written: {error.strerror} ({HAS_ROOM})")
        sys.exit(ExitCode.UNEXPECTED)


def can_redraw() -> bool:
    """Return whether standard output is a terminal that can draw a picture in the place of the one before."""
    return sys.stdout.isatty() and os.environ.get("TERM", "").lower() not in _ONLY_LINES


def _open_closed_ones() -> None:
    for descriptor, (name, mode) in enumerate(_STREAMS):
        try:
            os.fstat(descriptor)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            os.dup2(null, descriptor)
            if null != descriptor:
                os.close(null)
            os.set_inheritable(descriptor, True)
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(descriptor, mode, encoding="utf-8", closefd=False))


def _drop_output() -> None:
    """Drop the text that is not written yet, so that the interpreter does not complain at its end."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)
