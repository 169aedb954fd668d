"""Endings: a command's messages for the person at the terminal, and its exit codes.

Data goes to stdout, messages to stderr. Exit codes are those of ARCHITECTURE.md, section 5.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterable
from contextlib import suppress
from enum import IntEnum

from backbone.errors import BackboneError, HubUnreachable, LinkError, Refusal, code_of
from backbone.operating_system.ending_signals import interruptible
from backbone.printable_text import printable_lines


class ExitCode(IntEnum):
    """Exit codes of commands."""

    DONE = 0
    UNEXPECTED = 1
    USAGE = 2
    MISSION_INVALID = 3
    NO_BACKBONE = 4
    REFUSED = 5
    MISSION_FAILED = 6
    INTERRUPTED = 130


def say(line: str) -> None:
    """Print a message on stderr as printable text; the command continues if stderr is closed."""
    with suppress(OSError):
        print(printable_lines(line), file=sys.stderr, flush=True)


def show(lines: Iterable[str]) -> None:
    """Print data on stdout as printable text; Ctrl-C ends the printing even if no reader takes it. Main thread only."""
    for line in lines:
        with interruptible([signal.SIGINT]):
            print(printable_lines(line, most=sys.maxsize), flush=True)


def complaint_of(error: BackboneError) -> tuple[str, ExitCode]:
    """Return the message and the exit code for an error that ended a command."""
    match error:
        case Refusal():
            codes = {"run": ExitCode.NO_BACKBONE, "usage": ExitCode.USAGE}
            code = codes.get(code_of(error).partition(".")[0], ExitCode.REFUSED)
            return f"refused [{code_of(error)}]: {error}", code
        case HubUnreachable():
            return f"{error} (is the mission up there, and --secret-file the mission's?)", ExitCode.NO_BACKBONE
        case LinkError():
            return f"no answer: {error} (is the mission up? see 'scout-backbone status')", ExitCode.NO_BACKBONE
    return str(error), ExitCode.UNEXPECTED
