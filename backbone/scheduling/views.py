"""Views of the scheduler: the schedule, the reasons, and the attributes of each request."""

from __future__ import annotations

from typing import Annotated

from backbone.ranges import FEW, MANY, Count, Epoch, Instant, Mention, RunTime, Share, Text
from backbone.scheduling.requests import Holder, PathNode, RcUse, RequestState
from backbone.wire import Message


class RcView(Message, frozen=True, tag="RcView/2"):
    """An RC in the master schedule.

    Attributes:
        state: ``up`` or ``down``.
        capacity: Share of its time that it can give.
        holders: Its holders, with epochs and begins.
        last_epoch: Largest epoch given so far.
        next: ARCs that get it next, in the order of their predicted starts.
        until_s: Mission time at which the slice of each holder ends; negative: it is being disconnected.
        next_s: Mission times of their predicted starts, for each of ``next``.
        is_robot: True if it is a robot, which operators can stop.
    """

    rc: Mention
    kind: Mention
    state: Mention
    sharable: bool
    capacity: Share
    holders: Annotated[list[Holder], MANY]
    last_epoch: Epoch
    next: Annotated[list[Mention], MANY]
    until_s: Annotated[list[Instant], MANY] = []
    next_s: Annotated[list[Instant], MANY] = []
    is_robot: bool = False


class RequestView(Message, frozen=True):
    """A request in the master schedule.

    Attributes:
        state: State of the request.
        since_s: Mission time at which it entered that state.
        until_s: End of its slice; negative if it holds nothing.
        expected_start_s: Predicted grant; negative if it runs or none can be predicted.
        because: Reason why it runs or waits, one line.
        blockers: ARCs that block it directly; ``why`` names all that would have to be revoked.
        minimum_runtime_s: Requested minimum run time.
        priority: Its priority path, for people: ``mission:10/surveillance:5/watch-scout1:3``.
        rule: Rule of SCHEDULING.md that decides it.
        would_change: The event that would end this, for people.
        raised: Levels by which it rose because it waits long.
    """

    arc: Mention
    owner: Mention
    state: RequestState
    rcs: Annotated[list[Mention], FEW]
    since_s: Instant
    until_s: Instant
    expected_start_s: Instant
    because: Text
    blockers: Annotated[list[Mention], MANY]
    minimum_runtime_s: RunTime
    priority: Text
    turns: Count
    rule: Mention = ""
    would_change: Text = ""
    raised: Count = 0


class Schedule(Message, frozen=True):
    """Answer to ``AskSchedule``; also published on every change."""

    at_s: Instant
    rcs: Annotated[list[RcView], MANY]
    requests: Annotated[list[RequestView], MANY]
    groups: Annotated[list[Annotated[list[Mention], MANY]], MANY]


class Why(Message, frozen=True, tag="Why/2"):
    """Answer to ``AskWhy``.

    Attributes:
        name: Name in the question.
        state: Its state.
        lines: The reasons for people, most important first.
        rule: Rule of SCHEDULING.md that decides it.
        blockers: ARCs that cause this; without them a waiting ARC starts as soon as its RCs are up and free.
        expected_start_s: Predicted grant; negative if none.
        would_change: The event that would end the wait, for people.
        at_s: Mission time of the answer; negative: unknown.
    """

    name: Mention
    state: Mention
    lines: Annotated[list[Text], MANY]
    rule: Mention
    blockers: Annotated[list[Mention], MANY]
    expected_start_s: Instant
    would_change: Text
    at_s: Instant = -1.0


class Period(Message, frozen=True):
    """Time between two re-plannings of an RC; its shares are those after the first and before the second.

    Attributes:
        until_s: Mission time of the second; negative: it has not come.
        because: Cause of the first re-planning, for people.
        shares: ARC → share of the time, or of the capacity, that it had.
    """

    since_s: Instant
    until_s: Instant
    because: Text
    shares: Annotated[dict[Mention, Share], MANY]


class RcUtilization(Message, frozen=True):
    """Share of the time in which an RC was held; of a sharable one the share of its capacity that was given out.

    Attributes:
        since_s: Mission time at which counting began.
        minute: Share over the last minute, or since ``since_s`` if that is shorter.
        ten_minutes: Share over the last ten minutes, or since ``since_s`` if that is shorter.
        periods: The last periods, oldest first, the present one last; empty unless asked for.
    """

    rc: Mention
    since_s: Instant
    minute: Share
    ten_minutes: Share
    periods: Annotated[list[Period], MANY] = []


class Utilization(Message, frozen=True):
    """Answer to ``AskUtilization``: all RCs."""

    at_s: Instant
    rcs: Annotated[list[RcUtilization], MANY]


class RequestAttributes(Message, frozen=True):
    """The present request of one ARC.

    Attributes:
        state: State of the request.
        uses: RC → its use.
        minimum_runtime_s: Shortest slice.
        maximum_runtime_s: End of all extensions.
        path: Names and priorities from the mission's root to the decision process, or of the console alone.
        console: True if the owner is a console.
        stops_at_once: True if the end of a slice need not wait for the decision process.
    """

    arc: Mention
    owner: Mention
    state: RequestState
    uses: Annotated[dict[Mention, RcUse], FEW]
    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime
    path: Annotated[list[PathNode], FEW]
    console: bool
    stops_at_once: bool


class Attributes(Message, frozen=True):
    """Answer to ``AskAttributes``: at least one request."""

    requests: Annotated[list[RequestAttributes], MANY]
