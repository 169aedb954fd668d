"""What supervision decides: instructions, carried out in order by the keeper."""

from __future__ import annotations

import signal
from dataclasses import dataclass

from backbone.creator.messages import EndedBy


@dataclass(frozen=True, slots=True)
class Fork:
    """Have it running; report ``forked`` or ``fork_failed``."""

    name: str


@dataclass(frozen=True, slots=True)
class AskToStop:
    """Ask it to stop; report ``ask_failed`` if it does not say that it will."""

    name: str
    within_s: float


@dataclass(frozen=True, slots=True)
class Signal:
    """Send the signal to everything that belongs to this process."""

    name: str
    pid: int
    number: signal.Signals


@dataclass(frozen=True, slots=True)
class ReportReady:
    """It is ready, for the first time or again."""

    name: str
    pid: int


@dataclass(frozen=True, slots=True)
class ReportStartFailed:
    """It never became ready, and will not by this order."""

    name: str
    how: str


@dataclass(frozen=True, slots=True)
class ReportEnded:
    """Its end was ordered, and nothing of it is left."""

    name: str
    by: EndedBy
    exit_code: int


@dataclass(frozen=True, slots=True)
class ReportLeft:
    """It ended in good order by itself and is not supervised any more."""

    name: str


@dataclass(frozen=True, slots=True)
class ReportFell:
    """It ended unexpectedly.

    Attributes:
        restart_in_s: Pause until its restart; negative: its owner has to ask for another one.
        failing: Whether it ended more often than its policy's limit.
    """

    name: str
    how: str
    restart_in_s: float
    failing: bool = False


@dataclass(frozen=True, slots=True)
class ReportSilent:
    """It shows no sign of life, or does so again.

    Attributes:
        silent_s: For how long, seconds of the machine; 0: it responds again.
    """

    name: str
    silent_s: float


@dataclass(frozen=True, slots=True)
class WakeAt:
    """Report ``woken`` at this time at the latest; replaces what earlier answers said."""

    at_s: float


Instruction = (
    Fork
    | AskToStop
    | Signal
    | ReportReady
    | ReportStartFailed
    | ReportEnded
    | ReportLeft
    | ReportFell
    | ReportSilent
    | WakeAt
)
