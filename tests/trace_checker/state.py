"""What a trace has said so far of each RC and each ARC."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import inf

from .admission import Stream
from .priority_order import Path
from .violation import Violation


class Phase(Enum):
    """Where an ARC stands."""

    IDLE = "idle"
    WAITING = "waiting"
    CONNECTING = "connecting"
    RUNNING = "running"
    REVOKING = "revoking"
    GONE = "gone"


HOLDING = (Phase.CONNECTING, Phase.RUNNING)


@dataclass(slots=True, eq=False)
class Rc:
    """One RC.

    Attributes:
        epoch: The newest epoch.
        down_s: Since when it is down.
        changed_s: When its capacity changed, as long as its holders may still exceed it.
        holders: ARCs that connect, run or are being revoked on it, by name.
    """

    name: str
    sharable: bool
    capacity: float
    connect_s: float
    disconnect_s: float
    up: bool = True
    epoch: int = -1
    down_s: float | None = None
    changed_s: float | None = None
    holders: dict[str, Arc] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class Arc:
    """One ARC with its request.

    Attributes:
        node: Its owner.
        uses: RC → its streams; no streams: an exclusive use.
        settle_s, release_s: Longest connect and disconnect time of its RCs.
        wants: It has asked for time and has not taken that back.
        is_leaving: It has departed, and its RCs are not free yet.
        stamp: When it became active or was last served, and the number of the line.
        freed_for: Its place in the order while RCs that were freed by force are reserved for it.
        late: What is to be reported of its revocation, unless an RC was down meanwhile.
        has_lost: One of its RCs was down while it was being revoked.
        since_s: Since when it waits.
        served_s: When its slice has lasted for the minimum run time that held at its begin.
        until_s: The end that it asked to extend its slice to.
        due_s: Since when it could start.
        is_reported: That it could start and waits is reported.
        active_s: From when to when it was active; no end yet: infinite.
        services: From when to when it ran, slice by slice.
        moved_s: When its priority changed first.
    """

    name: str
    node: str
    path: Path
    min_run_s: float
    max_run_s: float
    uses: dict[str, tuple[Stream, ...]]
    settle_s: float
    release_s: float
    phase: Phase = Phase.IDLE
    wants: bool = False
    is_leaving: bool = False
    stamp: tuple[float, int] = (0.0, 0)
    freed_for: tuple[float, int] | None = None
    since_s: float = 0.0
    connect_s: float = 0.0
    begin_s: float = 0.0
    served_s: float = 0.0
    until_s: float = 0.0
    revoke_s: float = 0.0
    late: Violation | None = None
    has_lost: bool = False
    due_s: float | None = None
    is_reported: bool = False
    active_s: list[tuple[float, float]] = field(default_factory=list)
    services: list[tuple[float, float]] = field(default_factory=list)
    moved_s: float = inf

    @property
    def rank(self) -> tuple[float, int]:
        """Its place among its equals."""
        return self.freed_for or self.stamp

    @property
    def length_s(self) -> float:
        """How long a run keeps its RCs at least."""
        return self.settle_s + self.min_run_s

    def begin_slice(self, now_s: float) -> None:
        self.begin_s, self.served_s, self.until_s = now_s, now_s + self.min_run_s, 0.0

    def slice_end_s(self, now_s: float) -> float:
        """Return until when its equals leave it alone."""
        if self.phase is Phase.CONNECTING:
            return max(now_s, self.connect_s + self.length_s)
        return max(self.served_s, min(self.until_s, self.begin_s + self.max_run_s))

    def is_served(self, now_s: float, slack_s: float) -> bool:
        return self.phase is Phase.RUNNING and self.slice_end_s(now_s) <= now_s + slack_s
