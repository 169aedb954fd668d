"""Instructions: decisions of supervision, which the process keeper carries out in order; the words for an end."""

from __future__ import annotations

import signal
from dataclasses import dataclass

from backbone.creator.messages import EndedBy


@dataclass(frozen=True, slots=True)
class ForkComponent:
    """Fork the component; report ``forked`` or ``fork_failed``."""

    name: str


@dataclass(frozen=True, slots=True)
class AskToStop:
    """Ask the component to stop; report ``ask_failed`` if it does not agree."""

    name: str
    within_s: float


@dataclass(frozen=True, slots=True)
class SendSignal:
    """Send the signal to the process tree."""

    name: str
    pid: int
    number: signal.Signals


@dataclass(frozen=True, slots=True)
class ReportReady:
    """The component is ready, for the first time or again."""

    name: str
    pid: int


@dataclass(frozen=True, slots=True)
class ReportStartFailed:
    """The start has failed and is not repeated."""

    name: str
    how: str


@dataclass(frozen=True, slots=True)
class ReportEnded:
    """The process tree ended by order."""

    name: str
    by: EndedBy
    exit_code: int


@dataclass(frozen=True, slots=True)
class ReportLeft:
    """The component ended by itself with exit code 0; its supervision has ended."""

    name: str


@dataclass(frozen=True, slots=True)
class ReportFell:
    """The component ended unexpectedly.

    Attributes:
        restart_in_s: Pause until the restart; negative: no restart, the owner must ask for a new start.
        failing: Whether it ended more often than the limit of its policy.
    """

    name: str
    how: str
    restart_in_s: float
    failing: bool = False


@dataclass(frozen=True, slots=True)
class ReportSilent:
    """The component shows no sign of life, or responds again.

    Attributes:
        silent_s: Duration of the silence, seconds of the machine; 0: it responds again.
    """

    name: str
    silent_s: float


@dataclass(frozen=True, slots=True)
class SupervisionWakesAt:
    """Report ``woken`` at this time at the latest; replaces earlier ``SupervisionWakesAt``."""

    at_s: float


Instruction = (
    ForkComponent
    | AskToStop
    | SendSignal
    | ReportReady
    | ReportStartFailed
    | ReportEnded
    | ReportLeft
    | ReportFell
    | ReportSilent
    | SupervisionWakesAt
)


CRASHES = frozenset({signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL})
"""Signals that a process gets because of its own code."""


def describe(returncode: int, cause: str = "") -> str:
    """Return how a process ended, for people.

    Example:
        >>> describe(1, "ValueError: no picture"), describe(-9), describe(-11, "pan.py, line 7, in update")
        ('exit code 1: ValueError: no picture', 'killed by SIGKILL', 'killed by SIGSEGV: pan.py, line 7, in update')
    """
    if returncode >= 0:
        return f"exit code {returncode}{cause and ': '}{cause}"
    try:
        killed = f"killed by {signal.Signals(-returncode).name}"
    except ValueError:
        return f"killed by signal {-returncode}"
    return f"{killed}: {cause}" if cause and -returncode in CRASHES else killed
