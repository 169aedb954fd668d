"""Rehearsal: simulates the components around a schedule manager, to show a schedule before the mission starts.

RCs settle and disconnect in their declared times, decision processes stop after a given pause, timers fire when they
are due. No bus, no clock: time jumps from one event to the next.

Rules of this file:

* It decides nothing: every run, wait and load is read from the schedule manager's trace.
* The same events in the same order give the same trace.
"""

from __future__ import annotations

import heapq
import itertools
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, assert_never

from backbone.scheduling import trace
from backbone.scheduling.events import (
    ConnectArc,
    Event,
    Freed,
    Instruction,
    Opened,
    RcKnown,
    Record,
    RenewLeases,
    RevokeArc,
    WakeAt,
    Woken,
)
from backbone.scheduling.trace import Line

MOST_AT_ONCE = 1000  # chosen: far above the two connections of one ARC that any schedule needs at one instant


class Decides(Protocol):
    """The rehearsed object: a schedule manager, or a wrapper of one."""

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Apply an event and return the instructions."""


def at_once(deadline_s: float) -> float:
    """Return the pause of a decision process that stops at once."""
    del deadline_s
    return 0.0


class Rehearsal:
    """Simulates time, RCs and decision processes for one schedule manager.

    Attributes:
        now_s: Mission time of the last event.
        trace: All lines so far.
        manager: The schedule manager; may be replaced by one with the same state.
        connected: ARCs that have RCs, settling or granted, in the order of their connections, with the times.
    """

    def __init__(
        self,
        manager: Decides,
        *,
        opening_lines: Iterable[Record] = (),
        pause_s: Callable[[float], float] = at_once,
    ) -> None:
        """Begin at time 0 with no RCs and no ARCs.

        Args:
            manager: The schedule manager.
            opening_lines: Records with which the trace begins.
            pause_s: Deadline in seconds → seconds that a decision process takes to stop.
        """
        self.now_s = 0.0
        self.trace: list[Line] = [record.line for record in opening_lines]
        self.manager = manager
        self.connected: dict[str, float] = {}
        self._pause_s = pause_s
        self._release_s: dict[str, float] = {}
        self._agenda: list[tuple[float, int, Event]] = []
        self._serial = itertools.count()
        self._opening: dict[str, Opened] = {}
        self._at_once: Counter[str] = Counter()
        self._wake_s: float | None = None

    @classmethod
    def going_on(
        cls,
        manager: Decides,
        now_s: float,
        *,
        under_way: Iterable[tuple[float, Opened | Freed]],
        release_s: Mapping[str, float],
        wake_s: float | None,
        pause_s: Callable[[float], float],
    ) -> Rehearsal:
        """Continue from a present schedule.

        Args:
            manager: A copy of the schedule manager, used only by this rehearsal.
            under_way: Outcomes of the running context switches, with their times.
            release_s: RC → its release time.
            wake_s: Time at which the manager must be woken.
            pause_s: Deadline in seconds → seconds that a decision process takes to stop.
        """
        rehearsal = cls(manager, pause_s=pause_s)
        rehearsal.now_s, rehearsal._wake_s = now_s, wake_s
        rehearsal._release_s = dict(release_s)
        for time_s, event in under_way:
            rehearsal.at(time_s, event)
            if isinstance(event, Opened):
                rehearsal._opening[event.arc] = event
        return rehearsal

    def at(self, time_s: float, event: Event) -> None:
        """Schedule the event at that time, after all earlier ones of the same time."""
        heapq.heappush(self._agenda, (time_s, next(self._serial), event))

    def tell(self, event: Event) -> None:
        """Apply the event now.

        Raises:
            AssertionError: Time does not advance: the manager connects an ARC ``MOST_AT_ONCE`` times at one instant.
        """
        if isinstance(event, RcKnown):
            self._release_s[event.rc] = event.disconnect_s
        for instruction in self.manager.handle(event, self.now_s):
            match instruction:
                case Record(line=line):
                    self.trace.append(line)
                case WakeAt(at_s=at_s):
                    self._wake_s = at_s
                case ConnectArc(arc=arc, settle_s=settle_s):
                    self._opening[arc] = Opened(arc)
                    self.connected[arc] = self.now_s
                    self._require_progress(arc)
                    self.at(self.now_s + settle_s, self._opening[arc])
                case RevokeArc(arc=arc, epochs=epochs, deadline_s=deadline_s):
                    self._opening.pop(arc, None)
                    self.connected.pop(arc, None)
                    release_s = max((self._release_s[rc] for rc in epochs), default=0.0)
                    self.at(self.now_s + self._pause_s(deadline_s) + release_s, Freed(arc))
                case RenewLeases():
                    pass
                case _:
                    assert_never(instruction)

    def run(self, until_s: float) -> None:
        """Let time pass; afterwards all events due until then have been applied."""
        while self.step(until_s):
            pass
        self.now_s = max(self.now_s, until_s)

    def step(self, until_s: float) -> bool:
        """Apply the next event if it is due by ``until_s``; return whether one was."""
        next_s = self._next_s()
        if next_s is None or next_s > until_s:
            return False
        if next_s > self.now_s:
            self.now_s = next_s
            self._at_once.clear()
        if not self._agenda or self._agenda[0][0] > self.now_s:
            self._wake_s = None
            self.tell(Woken())
            return True
        event = heapq.heappop(self._agenda)[2]
        if not isinstance(event, Opened):
            self.tell(event)
        elif self._opening.get(event.arc) is event:  # else its connection was aborted
            del self._opening[event.arc]
            self.tell(event)
        return True

    def _require_progress(self, arc: str) -> None:
        self._at_once[arc] += 1
        if self._at_once[arc] == MOST_AT_ONCE:
            last = "\n".join(str(dict(line)) for line in self.trace[-8:])
            raise AssertionError(f"{arc} is connected {MOST_AT_ONCE} times at {self.now_s}; the last lines:\n{last}")

    def _next_s(self) -> float | None:
        agenda_s = self._agenda[0][0] if self._agenda else None
        if agenda_s is None or self._wake_s is None:
            return self._wake_s if agenda_s is None else agenda_s
        return min(agenda_s, self._wake_s)


@dataclass(slots=True)
class Run:
    """A time for which an ARC had its RCs.

    Attributes:
        uses: RC → share of its time, 0 to 1; an exclusive use is 1.
        connect_s: Time at which its RCs began to settle.
        grant_s: Time of its grant; None: it was not granted.
        revoke_s: Time of its revocation; else the end of the trace.
        free_s: Time at which its RCs were free again; else the end of the trace.
        why: Reason of the revocation; empty: it was not revoked.
        by: ARC or RC that caused the revocation.
    """

    arc: str
    uses: Mapping[str, float]
    connect_s: float
    grant_s: float | None
    revoke_s: float
    free_s: float
    why: str = ""
    by: str = ""

    @property
    def granted_s(self) -> float:
        """Seconds during which its gate was open."""
        return 0.0 if self.grant_s is None else self.revoke_s - self.grant_s


class Timetable:
    """Runs and waits of a trace, up to a time.

    Attributes:
        end_s: Last moment of the timetable.
        runs: All runs in the order of their beginnings.
        asked_s: ARC → time of its first request.
    """

    def __init__(self, lines: Iterable[Line], end_s: float) -> None:
        """Read lines with times from 0 to ``end_s``."""
        self.end_s = end_s
        self.runs: list[Run] = []
        self.asked_s: dict[str, float] = {}
        self._rcs: list[str] = []
        self._uses: dict[str, Mapping[str, float]] = {}
        self._present: dict[str, Run] = {}
        self._waiting_since_s: dict[str, float] = {}
        self._content: set[str] = set()
        self._worst_wait_s: dict[str, float] = {}
        for line in lines:
            self._read(line)

    def of_arc(self, arc: str) -> list[Run]:
        """Return the runs of this ARC."""
        return [run for run in self.runs if run.arc == arc]

    def worst_wait_s(self, arc: str) -> float:
        """Return the longest wait of this ARC, including a wait that has not ended."""
        since_s = self._waiting_since_s.get(arc)
        return max(self._worst_wait_s.get(arc, 0.0), 0.0 if since_s is None else self.end_s - since_s)

    def utilization(self) -> dict[str, float]:
        """Return, for each RC, the share of the time, 0 to 1, in which ARCs could use it; a sharable RC by streams."""
        used_s = defaultdict(float, dict.fromkeys(self._rcs, 0.0))
        for run in self.runs:
            for rc, share in run.uses.items():
                used_s[rc] += share * run.granted_s
        return {rc: seconds / self.end_s if self.end_s > 0 else 0.0 for rc, seconds in used_s.items()}

    def mean_parallel(self, since_s: float = 0.0) -> float:
        """Return the average number of ARCs that ran at once, over the time from ``since_s`` on."""
        granted_s = sum(
            max(0.0, run.revoke_s - max(run.grant_s, since_s)) for run in self.runs if run.grant_s is not None
        )
        return granted_s / (self.end_s - since_s) if self.end_s > since_s else 0.0

    def _read(self, line: Line) -> None:
        time_s, arc = float(line["t"]), str(line.get("arc", ""))
        match line["ev"]:
            case "rc":
                self._rcs.append(line["id"])
            case "request":
                self._uses[arc] = {rc: _share(use) for rc, use in line["use"].items()}
                self.asked_s.setdefault(arc, time_s)
                self._content.discard(arc)
                if line.get("idle"):
                    self._content.add(arc)
                else:
                    self._waiting_since_s[arc] = time_s
            case "want":
                self._content.discard(arc)
                self._waiting_since_s[arc] = time_s
            case "idle" | "depart":
                self._content.add(arc)
                self._end_wait(arc, time_s)
            case "connect":
                self._present[arc] = Run(arc, self._uses[arc], time_s, None, self.end_s, self.end_s)
                self.runs.append(self._present[arc])
            case "grant":
                self._present[arc].grant_s = time_s
                self._end_wait(arc, time_s)
            case "revoke":
                run = self._present[arc]
                run.revoke_s, run.why, run.by = time_s, line["why"], line.get("by", "")
                if arc not in self._content and arc not in self._waiting_since_s:
                    self._waiting_since_s[arc] = time_s
            case "free":
                self._present.pop(arc).free_s = time_s

    def _end_wait(self, arc: str, time_s: float) -> None:
        since_s = self._waiting_since_s.pop(arc, None)
        if since_s is not None:
            self._worst_wait_s[arc] = max(self._worst_wait_s.get(arc, 0.0), time_s - since_s)


def _share(use: Any) -> float:
    return 1.0 if use == trace.EXCLUSIVE else sum(stream["cost"] / stream["period"] for stream in use)
