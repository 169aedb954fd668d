"""The pipe from a launcher in the background to the command that started it: messages, then one verdict.

Rules of this file: each line is one JSON object. The lines for people come first, then the verdict with the exit code
of the command as the last line. A pipe that ends without a verdict means that the launcher died.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from typing import TextIO

import msgspec

from backbone.printable_text import printable_lines


class Talk(msgspec.Struct, frozen=True, tag="talk"):
    """A line for people."""

    line: str


class Verdict(msgspec.Struct, frozen=True, tag="verdict"):
    """The launcher's verdict on the start.

    Attributes:
        exit_code: 0: the mission is up and continues; else the exit code of the failed mission.
    """

    exit_code: int


_lines = msgspec.json.Decoder(Talk | Verdict)


class VerdictPipe:
    """The launcher's end of the pipe; lines after the verdict are dropped.

    Args:
        file: The pipe; closed after the verdict, or when its reader is gone.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def talk(self, line: str) -> None:
        """Write a line for people."""
        self._write(Talk(line))

    def decide(self, exit_code: int) -> None:
        """Write the verdict, unless one was written before."""
        self._write(Verdict(int(exit_code)))
        self._close()

    def _write(self, said: Talk | Verdict) -> None:
        if self._file.closed:
            return
        try:
            print(msgspec.json.encode(said).decode(), file=self._file, flush=True)
        except OSError:  # the command was killed; the mission does not depend on it
            self._close()

    def _close(self) -> None:
        with contextlib.suppress(OSError):
            self._file.close()


def await_verdict(lines: Iterable[str], say: Callable[[str], None]) -> int | None:
    """Pass every line for people to ``say`` until the verdict; return its exit code. None: the pipe has no verdict.

    Example:
        >>> await_verdict(['{"type":"talk","line":"comes up"}', '{"type":"verdict","exit_code":6}'], print)
        comes up
        6
    """
    for line in lines:
        match _lines.decode(line):
            case Talk(line=said):
                say(printable_lines(said))
            case Verdict(exit_code=exit_code):
                return exit_code
    return None
