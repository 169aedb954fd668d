"""Outcome of a mission, and the observer that shows its bring-up to a person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from backbone.bus.interface import Bus, Clock
from backbone.creator.messages import EndedBy, ProcessEnded, StartFailed
from backbone.errors import BackboneError, complaint
from backbone.picture.words import NAMES_SHOWN, counted_names

HANG_UP = "SIGHUP"  # a signal's name: the order of a terminal that is closed


def with_signals(ended: Sequence[ProcessEnded]) -> str:
    """Return the components with the signals that ended them, for people; if these are many, by signal; empty: none.

    Example:
        >>> with_signals([ProcessEnded("spin", EndedBy.SIGKILL, 0)])
        'needed a signal to end: spin (sigkill)'
    """
    if len(ended) <= NAMES_SHOWN:
        told = ", ".join(f"{end.name} ({end.by})" for end in ended)
    else:
        by = {signal: [end.name for end in ended if end.by is signal] for signal in EndedBy}
        told = ", ".join(f"{counted_names(names)} by {signal}" for signal, names in by.items() if names)
    return f"needed a signal to end: {told}" if ended else ""


@dataclass
class Outcome:
    """The outcome of a mission.

    Attributes:
        ready_after_s: Seconds of the machine from the start until all was ready; None if it was never ready.
        failure: Why it failed; None if it did not fail.
        order: The first order to end.
        ended: How each process ended, in the order of their ends.
    """

    ready_after_s: float | None = None
    failure: BaseException | None = None
    order: str = ""
    ended: list[ProcessEnded] = field(default_factory=list)

    @property
    def why_failed(self) -> str:
        """Why it failed, with the name of a component that refused to start."""
        told = str(self.failure)
        name = str(self.failure.facts.get("name", "")) if isinstance(self.failure, StartFailed) else ""
        return told if told.startswith(name) else f"{name}: {told}"

    @property
    def unexpected_end(self) -> str:
        """What ended a mission that was up, if no person or service manager ordered its end; else empty."""
        if self.ready_after_s is None:
            return ""
        if isinstance(self.failure, BackboneError):
            return self.why_failed
        if self.failure is not None:
            return f"its launcher failed: {complaint(self.failure)}"
        return f"{self.order}, as its terminal was closed" if self.order == HANG_UP else ""

    @property
    def pushed(self) -> list[ProcessEnded]:
        """Processes that needed a signal, because they were starting or did not answer."""
        return [end for end in self.ended if end.by in (EndedBy.SIGTERM, EndedBy.SIGKILL)]

    @property
    def went_well(self) -> bool:
        """True if it came up, nothing failed, and every process ended in good order or by SIGTERM."""
        killed = any(end.by is EndedBy.SIGKILL for end in self.ended)
        return self.ready_after_s is not None and self.failure is None and not killed


class BringUpObserver(Protocol):
    """Shows a mission's bring-up, run and end to a person."""

    def comes_up(self, mission: str) -> None:
        """Show that this mission comes up: every precondition holds. Called once, before the first step."""

    def began(self, step: str) -> None:
        """Show that this step has begun."""

    def done(self, step: str, took_s: float) -> None:
        """Show that this step is done after these seconds of the machine."""

    def announce(self, line: str) -> None:
        """Show a message to the person."""

    def connected(self, bus: Bus) -> None:
        """Subscribe to the mission's messages. Called when only the hub is up."""

    async def up(self, bus: Bus, clock: Clock) -> None:
        """Run while the mission is up; cancelled when it ends."""
