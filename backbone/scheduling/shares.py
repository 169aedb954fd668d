"""Shares: the part of each RC that each ARC had, over the last minutes and between two re-plannings.

An ARC gets a unit RC whole; of a sharable RC it gets a share, the sum of its streams. An ARC has an RC from its
connection until it is free, settling included.

Rules of this file:

* Pure: it reads the lines of the trace, so it agrees with the trace.
* Its size is bounded by the RCs, the ARCs with a request, and ``PERIODS_KEPT``; the cost of a line by the RCs that it
  concerns and their present holders.
* An RC is planned again when another set of ARCs requests it, a priority changes, or the RC goes down, comes back or
  changes its capacity. The time between two re-plannings is a period; its shares are those after the first and before
  the second.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass, field

from backbone.scheduling.requests import Usage
from backbone.scheduling.step_average import StepAverage
from backbone.scheduling.streams import stream, utilization
from backbone.scheduling.trace import EXCLUSIVE, Line
from backbone.scheduling.views import Period, RcUtilization

MINUTE_S, TEN_MINUTES_S = 60.0, 600.0
PERIODS_KEPT = 20  # chosen: some minutes of operation by hand
CAUSES_KEPT = 4  # chosen: a line for people; seldom more than two events come at one instant
PRESENT_S = -1.0


@dataclass
class _Period:
    """The present period of an RC.

    Attributes:
        had_s: ARC → seconds for which it had the RC, multiplied by its share; only of ended holds.
    """

    since_s: float
    causes: list[str] = field(default_factory=list)
    had_s: dict[str, float] = field(default_factory=dict)


class _RcShares:
    """The shares of one RC: its present holders, and its periods."""

    def __init__(self, known_s: float) -> None:
        self.known_s = known_s
        self.average = StepAverage(known_s)
        self.period = _Period(known_s, ["it is known"])
        self.periods: deque[Period] = deque(maxlen=PERIODS_KEPT - 1)
        self.capacity = 1.0
        self._given: dict[str, tuple[float, float]] = {}
        self._sum = 0.0

    def connect(self, arc: str, share: float, now_s: float) -> None:
        """Begin a hold."""
        if arc not in self._given:
            self._given[arc] = (share, now_s)
            self._sum += share
            self._step(now_s)

    def free(self, arc: str, now_s: float) -> None:
        """End a hold."""
        if arc not in self._given:
            return
        share, since_s = self._given.pop(arc)
        self._count(self.period.had_s, arc, share, since_s, now_s)
        self._sum = self._sum - share if self._given else 0.0
        self._step(now_s)

    def planned_again(self, cause: str, now_s: float) -> None:
        """Begin a period; if the present one began at the same time, add the cause to it."""
        if now_s > self.period.since_s:
            self.periods.append(self.present(now_s, until_s=now_s))
            self.period = _Period(now_s)
        if cause not in self.period.causes and len(self.period.causes) < CAUSES_KEPT:
            self.period.causes.append(cause)

    def set_capacity(self, capacity: float, now_s: float) -> None:
        """Set the part of its time that the RC can give."""
        self.capacity = capacity
        self._step(now_s)

    def present(self, now_s: float, *, until_s: float = PRESENT_S) -> Period:
        """Return the present period, counted up to now."""
        had_s = dict(self.period.had_s)
        for arc, (share, since_s) in self._given.items():
            self._count(had_s, arc, share, since_s, now_s)
        lasts_s = now_s - self.period.since_s
        shares = {arc: self._of_capacity(s / lasts_s) if lasts_s > 0 else 0.0 for arc, s in had_s.items()}
        return Period(self.period.since_s, until_s, "; ".join(self.period.causes), shares)

    def _count(self, had_s: dict[str, float], arc: str, share: float, since_s: float, now_s: float) -> None:
        held_s = max(0.0, now_s - max(since_s, self.period.since_s))
        had_s[arc] = had_s.get(arc, 0.0) + share * held_s

    def _step(self, now_s: float) -> None:
        self.average.step_to(self._of_capacity(self._sum), now_s)

    def _of_capacity(self, share: float) -> float:
        if share <= 0:
            return 0.0
        return min(1.0, share / self.capacity) if self.capacity > 0 else 1.0


class Shares:
    """The shares of all RCs of one schedule."""

    def __init__(self) -> None:
        """Begin with no RCs."""
        self._rcs: dict[str, _RcShares] = {}
        self._wishes: dict[str, dict[str, float]] = {}
        self._holding: dict[str, dict[str, float]] = {}
        self._nodes: dict[str, tuple[str | None, int]] = {}

    def know(self, rc: str, now_s: float) -> None:
        """Count this RC from now on; idempotent."""
        if rc not in self._rcs:
            self._rcs[rc] = _RcShares(now_s)

    def forget(self, rc: str) -> None:
        """Stop counting this RC."""
        self._rcs.pop(rc, None)

    def take(self, line: Line) -> None:
        """Count a line of the trace."""
        now_s = line["t"]
        match line["ev"]:
            case "request":
                self._requested(line["arc"], line["use"], now_s, idle=bool(line.get("idle")))
            case "want":
                self._plan_again(self._wishes.get(line["arc"], ()), f"{line['arc']} asks", now_s)
            case "idle":
                self._plan_again(self._wishes.get(line["arc"], ()), f"{line['arc']} is idle", now_s)
            case "depart":
                self._departs(line["arc"], now_s)
            case "connect":
                self._connected(line["arc"], now_s)
            case "free":
                self._freed(line["arc"], now_s)
            case "node":
                self._placed(line["id"], line["parent"], line["prio"], now_s)
            case "rc" | "rc_cap" | "rc_state":
                self._rc_changed(line, now_s)

    def utilizations(self, now_s: float, *, periods: bool) -> list[RcUtilization]:
        """Return the utilization of each RC.

        Args:
            periods: True: include the last periods, oldest first.
        """
        return [
            RcUtilization(
                rc,
                one.known_s,
                _share(one.average.over(MINUTE_S, now_s)),
                _share(one.average.over(TEN_MINUTES_S, now_s)),
                [*one.periods, one.present(max(now_s, one.period.since_s))] if periods else [],
            )
            for rc, one in self._rcs.items()
        ]

    def _requested(self, arc: str, use: dict[str, object], now_s: float, *, idle: bool) -> None:
        self._wishes[arc] = {rc: _share_of(streams) for rc, streams in use.items()}
        if not idle:
            self._plan_again(use, f"{arc} asks", now_s)

    def _departs(self, arc: str, now_s: float) -> None:
        self._plan_again(self._wishes.pop(arc, ()), f"{arc} leaves", now_s)

    def _connected(self, arc: str, now_s: float) -> None:
        self._holding[arc] = self._wishes.get(arc, {})
        for rc, share in self._holding[arc].items():
            if rc in self._rcs:
                self._rcs[rc].connect(arc, share, now_s)

    def _freed(self, arc: str, now_s: float) -> None:
        for rc in self._holding.pop(arc, ()):
            if rc in self._rcs:
                self._rcs[rc].free(arc, now_s)

    def _placed(self, node: str, parent: str | None, priority: int, now_s: float) -> None:
        known, self._nodes[node] = self._nodes.get(node), (parent, priority)
        if known is not None and known != (parent, priority):
            what = f"{node} has priority {priority}" if known[0] == parent else f"{node} stands below {parent}"
            self._plan_again({rc for wish in self._wishes.values() for rc in wish}, what, now_s)

    def _rc_changed(self, line: Line, now_s: float) -> None:
        rc = line["id"]
        self.know(rc, now_s)
        if "cap" in line:
            if line["ev"] == "rc_cap":
                self._plan_again([rc], f"its capacity is {line['cap']:g}", now_s)
            self._rcs[rc].set_capacity(line["cap"], now_s)
        else:
            self._plan_again([rc], f"it is {line['state']}", now_s)

    def _plan_again(self, rcs: Collection[str], cause: str, now_s: float) -> None:
        for rc in rcs:
            if rc in self._rcs:
                self._rcs[rc].planned_again(cause, now_s)


def _share_of(streams: object) -> float:
    """Return the share of an RC's time in the ``use`` field of a request's line."""
    if streams == EXCLUSIVE or not isinstance(streams, list):
        return 1.0
    return min(1.0, utilization([stream(Usage(each["period"], each["cost"])) for each in streams]))


def _share(value: float) -> float:
    """Return the value without the rounding of sums."""
    return min(1.0, max(0.0, value))
