"""Decisions: a placement's record, and the instructions of ``PlacementBook``."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from backbone.creator.messages import Spawn
from backbone.naming import address
from backbone.placer.messages import Placement


class PlacementPhase(StrEnum):
    """Phase of a placement."""

    STARTING = "starting"  # its creator has the order; it is not ready yet
    RUNNING = "running"  # its creator has it
    WAITING = "waiting"  # wanted, but lost its host or its process


@dataclass(slots=True)
class PlacementRecord:
    """One placement.

    Attributes:
        spawn: The order to its creator.
        pin: The only possible host; empty: any.
        host: The host on which it runs or starts; empty: none.
        pid: Its process; 0 if unknown.
        since_s: Mission time of the last decision about it.
        reasons: One line for each host.
        unwanted: True from the order to stop it.
        suspect: True while the placer must ask its creator whether it still runs.
        lost: True from the loss of its host until it has another host; it may return with the old one.
        missing_since_s: Mission time from which on it is missing; negative: it is not missing.
        cause: Why it is missing.
        doing: What the placer does to start it again.
        remedy: What an operator can do; empty: nothing.
    """

    spawn: Spawn
    pin: str
    phase: PlacementPhase
    host: str
    since_s: float
    pid: int = 0
    reasons: tuple[str, ...] = ()
    unwanted: bool = False
    suspect: bool = False
    lost: bool = False
    missing_since_s: float = -1.0
    cause: str = ""
    doing: str = ""
    remedy: str = ""

    @property
    def address(self) -> str:
        """Address of the component."""
        return address(self.spawn.subsystem, self.spawn.name)

    def placement(self) -> Placement:
        """Return the record as a message."""
        spawn = self.spawn
        return Placement(spawn.name, spawn.type, self.host, spawn.requester, self.since_s, list(self.reasons))

    def runs(self, pid: int) -> None:
        """Record that it has a process and is no longer missing."""
        self.pid, self.suspect = pid, False
        self.missing_since_s, self.cause, self.doing = -1.0, "", ""

    def is_on(self, host: str, pid: int, now_s: float) -> None:
        """Record that this host's creator has the component."""
        self.phase, self.missing_since_s = PlacementPhase.RUNNING, -1.0
        self.host, self.pid, self.since_s = host, pid, now_s
        self.reasons, self.lost, self.suspect = (f"{host}: its creator has it",), False, False

    def misses(self, cause: str, now_s: float, remedy: str = "") -> None:
        """Record that the component, which ran, is missing."""
        self.phase, self.host, self.pid, self.suspect = PlacementPhase.WAITING, "", 0, False
        self.cause, self.doing, self.remedy = cause, "is to be placed again", remedy
        if self.missing_since_s < 0:
            self.missing_since_s = now_s


@dataclass(frozen=True, slots=True)
class PlaceAgain:
    """Start this missing component again."""

    name: str


@dataclass(frozen=True, slots=True)
class EndOrphan:
    """End the component of this name on this host, because it is wanted on another host or not at all."""

    host: str
    name: str


@dataclass(frozen=True, slots=True)
class Inspect:
    """Ask this host's creator for its processes, and report the answer."""

    host: str


@dataclass(frozen=True, slots=True)
class Note:
    """Add this event about the subject to the story."""

    subject: str
    what: str


Instruction = PlaceAgain | EndOrphan | Inspect | Note
