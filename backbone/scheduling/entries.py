"""Entries: the record of each RC and of each ARC in the schedule, and of the decision that is being made.

Rule of this file: data, and values computed from it alone. ``state`` writes the entries, and ``transitions`` and
``slice_ends`` write how an ARC gets and loses its RCs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from backbone.scheduling.events import Instruction
from backbone.scheduling.priority import Level, Path, rank_of
from backbone.scheduling.requests import RcUse, RequestState, SchedulingRequest
from backbone.scheduling.streams import Stream

INSTANT_S = 1e-9  # chosen: times closer than this are the same; far above the rounding of sums of times
SOON_S = 1e-6  # chosen: an RC that should be free by now is expected at once, but is not free yet

HOLDING = frozenset({RequestState.CONNECTING, RequestState.RUNNING, RequestState.REVOKING})
CONNECTED = frozenset({RequestState.CONNECTING, RequestState.RUNNING})


@dataclass(slots=True)
class OpenDecision:
    """The present decision.

    Attributes:
        now_s: Its time; it never decreases from one decision to the next.
        instructions: The instructions for the loop so far, in their order.
        ended: ARCs whose slices it ended for an equal, each with a sharable RC that both use.
        is_put_off: True: requests that are as old follow, and nothing is decided before.
    """

    now_s: float = 0.0
    instructions: list[Instruction] = field(default_factory=list)
    ended: list[tuple[ArcEntry, str]] = field(default_factory=list)
    is_put_off: bool = False


@dataclass(slots=True)
class RcEntry:
    """One RC as the schedule sees it.

    Attributes:
        kind: Its type, for people.
        capacity: Part of its time that it can give, 0 to 1.
        connect_s: Settling time.
        disconnect_s: Release time.
        up: True if it answers.
        epoch: Largest epoch given so far, at the beginning of settling.
        granted_epoch: Largest epoch of a grant so far.
        failed: True if it went down; False if it was only not started yet.
        fault: Why it is put aside although it answers; empty: it is not put aside.
        is_robot: True if it is a robot, for people.
        holders: ARCs that hold it, settle for it, or are not yet free of it, in the order of their connections.
    """

    name: str
    kind: str
    sharable: bool
    capacity: float
    connect_s: float
    disconnect_s: float
    up: bool
    epoch: int
    granted_epoch: int = 0
    failed: bool = False
    fault: str = ""
    is_robot: bool = False
    holders: dict[ArcEntry, None] = field(default_factory=dict)


class Afterwards(Enum):
    """State of an ARC once its RCs are free."""

    WAIT = "wait"  # it is in the queue again already
    IDLE = "idle"
    WANT = "want"  # it set itself idle, and then wanted time again
    GONE = "gone"


@dataclass(slots=True, eq=False)
class ArcEntry:
    """One ARC in the master schedule.

    Attributes:
        name: Name of the ARC.
        request: Its request as last sent.
        uses: RC → its use; the chosen alternative.
        place_in_tree: Names from the root to its owner.
        path: The same names, each with its present number.
        level: Its level, one object for all siblings with its number.
        minimum_s: Run time it needs to be served, counted from the grant.
        length_s: Time from the beginning of settling to the end of its minimum run time.
        maximum_s: End of all extensions, counted from the grant.
        settle_s: Longest settling time of its RCs.
        release_s: Longest release time of its RCs.
        touches: The RCs it uses, as a set of bits.
        excludes: The RCs that it uses exclusively, as a set of bits.
        shares: Names of those it uses by streams.
        streams: Sharable RC → its streams there, by its present request, as in the trace.
        measured: Sharable RC → its streams with the measured packet times, if those are longer.
        stamp: Time at which it became active or was last served, and its number among the stamps of that time.
        reservation: Set while RCs are being freed for it by force, or where equals reserve nothing from each other: it
            comes before all equals; smaller is earlier.
        state: State of its request.
        active: True: it wants time, or still holds RCs.
        holds: True: RCs are connected to it, settling for it, or not yet free of it.
        queued: True: it has a place in the order: it waits, or will wait as soon as its RCs are free.
        since_s: Time at which it entered its state.
        began_s: Time at which its RCs began to settle, while it holds them.
        end_s: End of its slice, while it runs.
        granted_s: Time of its grant, while it runs.
        slice_s: Begin of its present slice, while it runs: the grant, or later if it stayed connected.
        epochs: RC → epoch, while it holds them.
        awaited: True: a check of it is scheduled, because an ARC waits for the end of its slice.
        look_s: Time of that check: the end of its slice, or later if the discipline lets it run on.
        afterwards: Its state when its RCs are free, while it is being revoked.
        has_forced: True: a holder was preempted in the middle of a slice for it, since it was queued or granted.
        retry_s: Time at which it is queued again, after its gate stayed shut or it left too often; None: when it wants.
        retry_why: Reason for that wait.
        had_s: Run time so far, as the discipline ``time`` counts it; without the present run.
        raised: Levels by which it rose because it waited long (aging).
        swapped_out: Reason of its last loss of its RCs; empty: it never lost them.
        swapped_out_by: ARC or RC that caused this.
        made_way: How often in a row it was revoked, before its slice was over, for the same wait of a higher ARC.
        made_way_for: That wait: name and stamp of the higher ARC.
    """

    name: str
    request: SchedulingRequest
    uses: Mapping[str, RcUse]
    place_in_tree: tuple[str, ...]
    path: Path
    level: Level
    minimum_s: float
    length_s: float
    maximum_s: float
    settle_s: float
    release_s: float
    since_s: float
    touches: int
    excludes: int
    shares: tuple[str, ...]
    streams: Mapping[str, Sequence[Stream]]
    measured: Mapping[str, Sequence[Stream]]
    stamp: tuple[float, int] = (0.0, 0)
    reservation: int | None = None
    state: RequestState = RequestState.IDLE
    active: bool = False
    holds: bool = False
    queued: bool = False
    began_s: float = 0.0
    end_s: float = 0.0
    granted_s: float = 0.0
    slice_s: float = 0.0
    epochs: dict[str, int] = field(default_factory=dict)
    awaited: bool = False
    look_s: float = 0.0
    afterwards: Afterwards = Afterwards.WAIT
    has_forced: bool = False
    retry_s: float | None = None
    retry_why: str = ""
    turns: int = 0
    had_s: float = 0.0
    raised: int = 0
    swapped_out: str = ""
    swapped_out_by: str = ""
    made_way: int = 0
    made_way_for: tuple[str, tuple[float, int]] = ("", (0.0, 0))

    def goes_before(self, other: ArcEntry) -> bool:
        """Return whether its owner is strictly higher than the other's."""
        return self.level is not other.level and rank_of(self, other) > 0

    @property
    def understates(self) -> bool:
        """Whether its packets take longer than its present request states."""
        return self.measured is not self.streams

    def served(self, now_s: float) -> bool:
        """Return whether it runs and had its whole slice."""
        return self.state is RequestState.RUNNING and now_s >= self.end_s - INSTANT_S
