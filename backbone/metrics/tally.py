"""Tally: how long each ARC held and waited for each RC, and how its hand-overs went. Pure.

Rules of this file:

* No number decreases. Time is counted up to the newest known instant. News about an earlier instant changes only what
  is counted afterwards.
* Each console has ARCs of its own. So of the ARCs that left, only the last ``GONE_KEPT`` have numbers.
* An RC that is not sharable is held for no longer than the watched time.
* A hold counts until its lease expires: while the RC manager is silent, nothing newer is known.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import Schedule

GONE_KEPT = 100  # chosen: the consoles of a busy hour, so that each page read by Prometheus had their last numbers
BUCKETS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Upper ends of the buckets of switch times. Chosen: from a switch between drivers to one that waits for a person."""


@dataclass
class SwitchHistogram:
    """Times of hand-overs of one RC from one ARC to another.

    Attributes:
        counts: Hand-overs by bucket; the last bucket has no upper end.
        sum_s: Sum of all times.
    """

    counts: list[int] = field(default_factory=lambda: [0] * (len(BUCKETS_S) + 1))
    sum_s: float = 0.0

    def add(self, lasted_s: float) -> None:
        """Count a hand-over of this duration."""
        self.counts[bisect_left(BUCKETS_S, lasted_s)] += 1
        self.sum_s += lasted_s


class Tally:
    """Counts from the first schedule and the first leases on.

    Attributes:
        watched_s: Mission time that was watched.
        held_s: RC and ARC → time held.
        waited_s: RC and ARC → time for which the ARC waited for a set with this RC.
        in_state_s: ARC and state of its request → time in this state.
        grants: RC and ARC → grants.
        revocations: RC, ARC and reason → revocations.
        switches: RC that is not sharable → times from the revocation of one ARC for the sake of another to the grant
            of that other, settling included.
        is_up: RC → whether it is up.
    """

    def __init__(self) -> None:
        self.watched_s = 0.0
        self.held_s: defaultdict[tuple[str, str], float] = defaultdict(float)
        self.waited_s: defaultdict[tuple[str, str], float] = defaultdict(float)
        self.in_state_s: defaultdict[tuple[str, str], float] = defaultdict(float)
        self.grants: Counter[tuple[str, str]] = Counter()
        self.revocations: Counter[tuple[str, str, str]] = Counter()
        self.switches: dict[str, SwitchHistogram] = {}
        self.is_up: dict[str, bool] = {}
        self._arcs: dict[str, None] = {}
        """ARCs with numbers; who was heard of last comes last."""
        self._schedule: Schedule | None = None
        self._now_s = self._known_until_s = float("-inf")
        self._granted: dict[tuple[str, str], int] = {}
        self._revoked: dict[str, tuple[float, str]] = {}

    def take_schedule(self, schedule: Schedule) -> None:
        """Count up to the time of this schedule, which is valid from then on; ignore one older than the last."""
        if self._schedule is not None and schedule.at_s < self._schedule.at_s:
            return
        self.advance(schedule.at_s)
        self._schedule = schedule
        self.is_up = {rc.rc: rc.state == "up" for rc in schedule.rcs}
        for rc in schedule.rcs:
            if not rc.sharable:
                self.switches.setdefault(rc.rc, SwitchHistogram())
        for request in schedule.requests:
            self._heard_of(request.arc)
        while len(self._arcs) > GONE_KEPT + len(schedule.requests):
            self._forget(next(iter(self._arcs)))

    def take_leases(self, leases: Leases, at_s: float) -> None:
        """Apply leases that were sent at this time: for their duration, the schedule is known."""
        if self._schedule is None:
            return
        if self._now_s == float("-inf"):
            self._now_s = at_s
        self.advance(at_s)
        self._known_until_s = max(self._known_until_s, at_s + leases.lease_s)

    def take_line(self, line: Mapping[str, Any]) -> None:
        """Apply one line of the trace of the schedule."""
        match line:
            case {"ev": "revoke", "t": at_s, "arc": arc, "why": why}:
                self._heard_of(arc)
                for rc in self._held_by(arc):
                    self.revocations[rc, arc, why] += 1
                    self._revoked[rc] = at_s, line.get("by", "")
            case {"ev": "grant", "t": at_s, "arc": arc, "epoch": dict(epochs)}:
                self._heard_of(arc)
                for rc, epoch in epochs.items():
                    self._granted_to(rc, arc, epoch, at_s)

    def advance(self, now_s: float) -> None:
        """Count up to this time; a time before the last one changes nothing."""
        if self._schedule is None or now_s <= self._now_s or self._now_s == float("-inf"):
            return
        self.watched_s += now_s - self._now_s
        known_s = max(0.0, min(now_s, self._known_until_s) - self._now_s)
        self._now_s = now_s
        for rc in self._schedule.rcs:
            for arc in {holder.arc for holder in rc.holders}:
                self.held_s[rc.rc, arc] += known_s
        for request in self._schedule.requests:
            self.in_state_s[request.arc, request.state] += known_s
            if request.state is RequestState.WAITING:
                for name in request.rcs:
                    self.waited_s[name, request.arc] += known_s

    def _heard_of(self, arc: str) -> None:
        self._arcs.pop(arc, None)
        self._arcs[arc] = None

    def _forget(self, arc: str) -> None:
        del self._arcs[arc]
        numbers: tuple[dict[Any, Any], ...] = (self.held_s, self.waited_s, self.grants, self.revocations, self._granted)
        for by_rc in numbers:
            for key in [key for key in by_rc if key[1] == arc]:
                del by_rc[key]
        for state in RequestState:
            self.in_state_s.pop((arc, state), None)

    def _held_by(self, arc: str) -> list[str]:
        rcs = self._schedule.rcs if self._schedule is not None else []
        return [rc.rc for rc in rcs if any(holder.arc == arc for holder in rc.holders)]

    def _granted_to(self, rc: str, arc: str, epoch: int, at_s: float) -> None:
        """Count a grant once; a restarted RC manager repeats the grants before its start with their old epochs."""
        if epoch <= self._granted.get((rc, arc), -1):
            return
        self._granted[rc, arc] = epoch
        self.grants[rc, arc] += 1
        revoked_s, for_whom = self._revoked.pop(rc, (at_s, ""))
        if for_whom == arc and rc in self.switches:
            self.switches[rc].add(max(0.0, at_s - revoked_s))
