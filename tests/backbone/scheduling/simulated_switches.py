"""A mission in which switches take their times and nothing else happens: a bench for the schedule manager.

It plays everybody around the schedule manager: RCs settle and disconnect, decision processes stop
within their grace, the alarm rings. What comes out is a trace and a table of runs.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterable
from typing import Any

from trace_checker import Violation, check

from backbone.scheduling.events import (
    ConnectArc,
    Event,
    Freed,
    Opened,
    OpenFailed,
    RcCameBack,
    RcKnown,
    Record,
    Requested,
    RevokeArc,
    WakeAt,
    Woken,
)
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.master_schedule import EXACT_UP_TO
from backbone.scheduling.own_planner import load_planner
from backbone.scheduling.requests import PathNode, RcUse, RequestState, SchedulingRequest, Usage
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager

MISSION = "watch"
TOLERANCE_S = 1e-6
REPAIR_S = 3.0
MOST_AT_ONCE = 3_000  # chosen: some ten times the events that the largest of these missions has at one instant


def unit(name: str, connect_s: float = 0.0, disconnect_s: float = 0.0, *, up: bool = True) -> RcKnown:
    return RcKnown(name, "thing", False, 1.0, connect_s, disconnect_s, up, 0)


def sharable(name: str, capacity: float = 1.0, connect_s: float = 0.0, disconnect_s: float = 0.0) -> RcKnown:
    return RcKnown(name, "radio", True, capacity, connect_s, disconnect_s, True, 0)


def load(share: float, period_s: float = 0.1) -> RcUse:
    return RcUse([Usage(period_s, share * period_s)])


def ask(
    arc: str,
    uses: str | dict[str, RcUse],
    *,
    priority: int = 1,
    run_s: float = 5.0,
    most_s: float = 0.0,
    path: Iterable[tuple[str, int]] | None = None,
    console: bool = False,
    idle: bool = False,
    stops_at_once: bool = False,
) -> Requested:
    """Return a request; its owner is a child of the mission's node unless a path is given."""
    wish = {rc: RcUse() for rc in uses.split()} if isinstance(uses, str) else uses
    nodes = list(path) if path is not None else [(MISSION, 0), (f"owner-{arc}", priority)]
    if console and path is None:
        nodes = [(f"owner-{arc}", priority)]
    request = SchedulingRequest(
        arc,
        f"mission_control/{nodes[-1][0]}",
        [PathNode(*node) for node in nodes],
        console,
        [wish],
        run_s,
        most_s,
        idle,
        stops_at_once,
    )
    return Requested(request, tuple(wish))


def manager(
    *, grace_s: float = 0.0, tolerance_s: float = TOLERANCE_S, exact_up_to: int = EXACT_UP_TO, **rules: Any
) -> ScheduleManager:
    chosen = SchedulingRules(grace_s=grace_s, **rules)
    return ScheduleManager(
        chosen,
        tolerance_s=tolerance_s,
        exact_up_to=exact_up_to,
        mission=MISSION,
        mission_priority=0,
        planner=load_planner(chosen.planner),
    )


class Bench:
    """Plays time, RCs and decision processes for one schedule manager.

    Attributes:
        rcs: The RCs it plays.
        trace: All lines so far.
        instructions: All instructions so far, with their times.
        fails: ARC → RC at which its next connections fail; empty name: at the ARC's gate.
    """

    def __init__(
        self,
        of: ScheduleManager,
        *rcs: RcKnown,
        pause_s: Callable[[float], float] = lambda deadline_s: 0.0,
        delay_s: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.manager = of
        self.now_s = 0.0
        self.trace: list[dict[str, Any]] = [dict(record.line) for record in of.opening_lines()]
        self.instructions: list[tuple[float, object]] = []
        self.fails: dict[str, str] = {}
        self.rcs = rcs
        self._release_s = {rc.rc: rc.disconnect_s for rc in rcs}
        self._pause_s = pause_s
        self._delay_s = delay_s
        self._agenda: list[tuple[float, int, Event]] = []
        self._serial = itertools.count()
        self._opening: dict[str, Event] = {}
        self._wake_s: float | None = None
        for rc in rcs:
            self.tell(rc)

    @property
    def answers(self) -> Answers:
        """What can be asked about the schedule."""
        return Answers(self.manager)

    def at(self, time_s: float, event: Event) -> None:
        heapq.heappush(self._agenda, (time_s, next(self._serial), event))

    def tell(self, event: Event) -> None:
        """Let it happen now."""
        for instruction in self.manager.handle(event, self.now_s):
            self.instructions.append((self.now_s, instruction))
            match instruction:
                case Record(line=line):
                    self.trace.append(dict(line))
                case WakeAt(at_s=at_s):
                    self._wake_s = at_s
                case ConnectArc(arc=arc, settle_s=settle_s):
                    fails = arc in self.fails
                    outcome: Event = OpenFailed(arc, self.fails.pop(arc)) if fails else Opened(arc)
                    self._opening[arc] = outcome
                    self.at(self.now_s + settle_s + self._delay_s(), outcome)
                    if isinstance(outcome, OpenFailed) and outcome.rc:
                        self.at(self.now_s + settle_s + REPAIR_S, RcCameBack(outcome.rc, 0))
                case RevokeArc(arc=arc, epochs=epochs, deadline_s=deadline_s):
                    self._opening.pop(arc, None)
                    release_s = max((self._release_s[rc] for rc in epochs), default=0.0)
                    self.at(self.now_s + self._pause_s(deadline_s) + release_s + self._delay_s(), Freed(arc))
        self.manager.check()

    def run(self, until_s: float) -> Bench:
        """Let time pass; everything due at the last instant still happens.

        Raises:
            AssertionError: Time stands still: a livelock.
        """
        at_once = 0
        while True:
            times_s = [self._agenda[0][0]] if self._agenda else []
            times_s += [self._wake_s] if self._wake_s is not None else []
            if not times_s or min(times_s) > until_s:
                break
            at_once = at_once + 1 if min(times_s) <= self.now_s else 0
            assert at_once < MOST_AT_ONCE, f"time stands still at {self.now_s}; the last lines: {self.trace[-8:]}"
            self.now_s = max(self.now_s, min(times_s))
            if self._agenda and self._agenda[0][0] <= self.now_s:
                event = heapq.heappop(self._agenda)[2]
                if isinstance(event, Opened | OpenFailed) and self._opening.get(event.arc) is not event:
                    continue  # its connection was broken off
                self.tell(event)
            else:
                self._wake_s = None
                self.tell(Woken())
        self.now_s = max(self.now_s, until_s)
        return self

    def runs(self, arc: str) -> list[tuple[float, float | None]]:
        """Return from when to when it ran; None: it still does."""
        found: list[tuple[float, float | None]] = []
        for line in self.trace:
            if line.get("arc") == arc and line["ev"] == "grant":
                found.append((line["t"], None))
            elif line.get("arc") == arc and line["ev"] == "revoke" and found and found[-1][1] is None:
                found[-1] = (found[-1][0], line["t"])
        return found

    def verdict(self) -> list[Violation]:
        """Return the violations that an independent checker finds in the trace so far."""
        return check([*self.trace, {"ev": "end", "t": self.now_s}])


def all_of(bench: Bench, kind: type) -> list:
    return [instruction for _, instruction in bench.instructions if isinstance(instruction, kind)]


def states(bench: Bench) -> dict[str, RequestState]:
    return {view.arc: view.state for view in bench.answers.schedule(bench.now_s).requests}
