"""The schedule over time: past, present and predicted holders of each resource.

Rules of this file: no bus, no clock, no screen. Schedules go in, in the order of their times; a view comes out, and
*now* is an argument.

* Turns of a resource with one holder at a time never overlap, in any order of the messages.
* A turn is kept for ``HISTORY_S`` after its end.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import msgspec
from msgspec.structs import replace

from backbone.mission_log.people import is_console
from backbone.naming import component_of
from backbone.scheduling.views import RcView, RequestView, Schedule

HISTORY_S = 180.0  # chosen: several rounds, if turns take seconds
TURNS_KEPT = 400  # chosen: bounds the memory for a resource that changes its holder twice a second


class Certainty(StrEnum):
    """Part of the timeline in which a slice lies."""

    PAST = "past"
    NOW = "now"
    NEXT = "next"  # predicted


class SliceView(msgspec.Struct, frozen=True):
    """A turn of one ARC with a resource.

    Attributes:
        who: Decision process.
        arc: Its ARC.
        epoch: Epoch of the grant; 0 for a predicted turn.
        from_s: Begin.
        to_s: End; for a running turn, the end of its slice; for a predicted one, the earliest end.
        certainty: Past, now or next.
        is_console: True if the owner is a console.
    """

    who: str
    arc: str
    epoch: int
    from_s: float
    to_s: float
    certainty: Certainty
    is_console: bool


class TimelineRow(msgspec.Struct, frozen=True):
    """A resource over time; slices in the order of their begin."""

    rc: str
    kind: str
    is_sharable: bool
    slices: list[SliceView]


class TimelineView(msgspec.Struct, frozen=True):
    """Past, present and predicted holders of each resource."""

    from_s: float
    now_s: float
    to_s: float
    rows: list[TimelineRow]


@dataclass(slots=True)
class _Row:
    kind: str
    is_sharable: bool
    past: deque[SliceView] = field(default_factory=lambda: deque(maxlen=TURNS_KEPT))
    now: dict[tuple[str, int], SliceView] = field(default_factory=dict)
    following: list[SliceView] = field(default_factory=list)
    free_since_s: float = 0.0


class Timeline:
    """The turns of every resource.

    Args:
        person: Returns the name of the person at a console; the name may become known later than the console's hold.
    """

    def __init__(self, person: Callable[[str], str] = component_of) -> None:
        self._person = person
        self._rows: dict[str, _Row] = {}
        self._at_s = 0.0

    def heard(self, schedule: Schedule) -> None:
        """Record a schedule; a schedule older than the last one changes nothing."""
        if schedule.at_s < self._at_s:
            return
        self._at_s = schedule.at_s
        requests = {request.arc: request for request in schedule.requests}
        for rc in schedule.rcs:
            row = self._rows.setdefault(rc.rc, _Row(rc.kind, rc.sharable))
            row.kind, row.is_sharable = rc.kind, rc.sharable
            _update(row, rc, requests, schedule.at_s)
        for name in self._rows.keys() - {rc.rc for rc in schedule.rcs}:
            del self._rows[name]
        for row in self._rows.values():
            while row.past and row.past[0].to_s < schedule.at_s - HISTORY_S:
                row.past.popleft()

    def view(self, now_s: float, past_s: float, next_s: float) -> TimelineView:
        """Return the part of the timeline around now.

        Args:
            now_s: Mission time.
            past_s: Seconds shown before now.
            next_s: Seconds shown after now.
        """
        from_s, to_s = now_s - past_s, now_s + next_s
        rows = [
            TimelineRow(name, row.kind, row.is_sharable, self._slices(row, from_s, now_s, to_s))
            for name, row in sorted(self._rows.items())
        ]
        return TimelineView(from_s, now_s, to_s, rows)

    def _slices(self, row: _Row, from_s: float, now_s: float, to_s: float) -> list[SliceView]:
        past = [replace(turn, to_s=max(turn.from_s, turn.to_s)) for turn in row.past if turn.to_s >= from_s]
        running = [replace(turn, to_s=max(turn.from_s, now_s, turn.to_s)) for turn in row.now.values()]
        following = [turn for turn in row.following if turn.from_s <= to_s]
        slices = [replace(turn, who=self._person(turn.who)) for turn in (*past, *running, *following)]
        return sorted(slices, key=lambda one: (one.from_s, one.to_s, one.arc))


def _update(row: _Row, rc: RcView, requests: dict[str, RequestView], at_s: float) -> None:
    holders = {(holder.arc, holder.epoch): holder for holder in rc.holders}
    for key in row.now.keys() - holders.keys():
        turn = row.now.pop(key)
        since_s = [holder.since_s for holder in rc.holders if not rc.sharable]
        ended_s = max(turn.from_s, min([at_s, *since_s]))
        row.past.append(replace(turn, to_s=ended_s, certainty=Certainty.PAST))
        row.free_since_s = max(row.free_since_s, ended_s)
    for number, (key, holder) in enumerate(holders.items()):
        until_s = rc.until_s[number] if number < len(rc.until_s) else -1.0
        turn = row.now.get(key) or _begun(row, rc, key, holder.since_s, requests, at_s)
        row.now[key] = replace(turn, to_s=until_s)
    row.following = [
        _turn(arc, requests, 0, start_s, Certainty.NEXT)
        for arc, start_s in zip(rc.next, rc.next_s, strict=False)
        if start_s >= 0
    ]


def _begun(
    row: _Row, rc: RcView, key: tuple[str, int], since_s: float, requests: dict[str, RequestView], at_s: float
) -> SliceView:
    """Return a new turn; its begin is not before the end of the last one, and not after the schedule's time."""
    arc, epoch = key
    earliest_s = 0.0 if rc.sharable else row.free_since_s
    from_s = min(max(since_s, earliest_s), max(at_s, earliest_s))
    return _turn(arc, requests, epoch, from_s, Certainty.NOW)


def _turn(arc: str, requests: dict[str, RequestView], epoch: int, from_s: float, certainty: Certainty) -> SliceView:
    """Return a turn of the minimum run time; ``who`` is the owner's address until it is shown."""
    request = requests.get(arc)
    owner, lasts_s = (request.owner, request.minimum_runtime_s) if request is not None else (arc, 0.0)
    return SliceView(owner, arc, epoch, from_s, from_s + lasts_s, certainty, is_console(owner))
