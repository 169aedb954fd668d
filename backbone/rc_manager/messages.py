"""What is said between the RC manager, the RCs and the ARCs, and what others may ask the RC manager.

Who speaks to whom:

* ARC → RC manager: ``SchedulingRequest``, ``Withdraw``, ``SetIdle``, ``ChangeRuntime``, ``Extend``.
* RC manager → ARC: ``OpenGate``, ``CloseGate``, ``AskRequest``, ``TakePath``.
* RC manager → RC: ``Connect``, ``Disconnect``, ``AskRc``; ``Leases`` as a publication.
* anybody → RC manager: ``AskSchedule``, ``AskWhy``, ``AskAttributes``, ``SetPriority``, ``MoveNode``.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from backbone.errors import Refusal
from backbone.ranges import (
    FEW,
    FEW_STREAMS,
    MANY,
    Address,
    Count,
    Duration,
    Epoch,
    Instant,
    LeaseSeconds,
    Mention,
    Name,
    Period,
    Priority,
    Rank,
    RunTime,
    Share,
    Text,
    Values,
)
from backbone.wire import Message

ADDRESS = "backbone/rc_manager"

LEASE_S = 2.0  # chosen: outlives a restart of the hub or RC manager (under 1 s), ends an orphan's hold soon
RENEW_EVERY_S = 0.5  # chosen: three renewals may be lost
EPOCHS_PER_S = 1000  # chosen: an RC that restarts begins above all it ever had, as no RC changes hands so often
EPOCHS_AHEAD = 1_000_000  # chosen: clocks of two hosts differ by less than 1000 s
BEAT_EVERY_S = 0.3  # chosen: ARC to RC manager; a hung ARC is noticed within BEAT_MISSED_S
BEAT_MISSED_S = 1.0  # chosen: three beats


# ---------------------------------------------------------------------- what an ARC asks for
class Usage(Message, frozen=True):
    """One periodic stream on a sharable RC (RAM 2002, "Sharable Resources": usage parameter).

    Attributes:
        period_s: Constant interval between requests.
        packet_time_s: Time one request takes.
        deadline_s: It must be done this long after its release; 0: the period.
        jitter_s: Its release may be late by this much.
        kind: What the requests are, for people (``drive``).
    """

    period_s: Period
    packet_time_s: Period
    deadline_s: Duration = 0.0
    jitter_s: Period = 0.0
    kind: Mention = ""


class RcUse(Message, frozen=True):
    """How an ARC uses one RC: exclusively, or by streams on a sharable one.

    Attributes:
        streams: Its streams; none means exclusive.
    """

    streams: Annotated[list[Usage], FEW_STREAMS] = []


class PathNode(Message, frozen=True):
    """One node on the way from the root to a decision process."""

    name: Name
    priority: Priority


class SchedulingRequest(Message, frozen=True):
    """Give my ARC run time (RAM 2002, "The RC Scheduler").

    Attributes:
        arc: Name of the ARC.
        owner: Address of its decision process.
        path: From the mission's root (or the console itself) to the decision process.
        console: True if the owner is a console: its path is a sibling of the mission's root.
        alternatives: Sets of RCs that would do, best first: RC name → use.
        minimum_runtime_s: Shortest useful time, above 0.
        maximum_runtime_s: End of all extensions, at least the minimum; 0: the minimum.
        idle: True: it exists but wants no time now.
        stops_at_once: True: the decision process commands nothing that must be brought to rest, so the end of
            its slice need not wait for it.
    """

    arc: Name
    owner: Address
    path: Annotated[list[PathNode], FEW]
    console: bool
    alternatives: Annotated[list[Annotated[dict[Mention, RcUse], FEW]], MANY]
    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime = 0.0
    idle: bool = False
    stops_at_once: bool = False


class RequestState(StrEnum):
    """Where a request is."""

    IDLE = "idle"
    WAITING = "waiting"
    CONNECTING = "connecting"
    RUNNING = "running"
    REVOKING = "revoking"


class Scheduled(Message, frozen=True):
    """Answer to ``SchedulingRequest``.

    Attributes:
        rcs: The RCs chosen of the alternatives.
        state: Running soon (connecting) or waiting.
        position: Place among the waiting of its group, 1 is next; 0 if it need not wait.
        blockers: ARCs that stand directly in its way; ``why`` tells all that would have to go.
        expected_start_s: Mission time of the predicted grant; negative: none can be predicted.
    """

    rcs: Annotated[list[Mention], FEW]
    state: RequestState
    position: Count
    blockers: Annotated[list[Mention], MANY]
    expected_start_s: Instant


class Withdraw(Message, frozen=True):
    """This ARC needs no time any more and is about to end."""

    arc: Mention
    reason: Text = ""


class SetIdle(Message, frozen=True):
    """Keep the request, free the RCs (idle), or want them again (not idle)."""

    arc: Mention
    idle: bool


class ChangeRuntime(Message, frozen=True):
    """Ask for other run times from the next slice on."""

    arc: Mention
    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime = 0.0


class Extend(Message, frozen=True):
    """Let the running slice last until this mission time, at most until grant + maximum run time."""

    arc: Mention
    until_s: Instant


class SetPriority(Message, frozen=True):
    """Give a node of the behavior tree, or a console, another priority among its siblings."""

    node: Mention
    priority: Priority


class MoveNode(Message, frozen=True):
    """Put a node of the behavior tree, with all below it, below another parent; its priority stays."""

    node: Mention
    parent: Mention


class Done(Message, frozen=True):
    """Answer to requests that need no other: it is so now."""


class Beat(Message, frozen=True):
    """Published by each ARC under ``Conversation.BEAT`` every ``BEAT_EVERY_S``: my loop runs and my owner's too."""

    arc: Mention


# ---------------------------------------------------------------------- to ARCs
class OpenGate(Message, frozen=True):
    """Your RCs are connected: prepare them, wait until they have settled, then let commands through.

    Attributes:
        epochs: RC name → epoch of this connection.
        settled_s: Mission time at which the RCs have settled; they began when they were ordered to connect.
        until_s: Mission time until which the slice lasts at least, counted from now.
    """

    epochs: Annotated[dict[Mention, Epoch], FEW]
    settled_s: Instant
    until_s: Instant


class GateOpens(Message, frozen=True):
    """Answer to ``OpenGate``: all is prepared; commands pass from ``settled_s`` on, and the owner hears ``Resumed``."""


class CloseGate(Message, frozen=True):
    """Let nothing pass any more.

    Attributes:
        reason: Why: ``slice``, ``higher``, ``rc``, ``self`` …
        by: ARC or RC because of which.
        deadline_s: Seconds the decision process has to stop cleanly; 0: none, a higher one overrides.
        expected_s: Mission time of the next expected slot; negative: unknown.
    """

    reason: Text
    by: Mention
    deadline_s: Duration
    expected_s: Instant


class GateClosed(Message, frozen=True):
    """Answer to ``CloseGate``: nothing passes."""


class AskRequest(Message, frozen=True):
    """What do you ask for and what do you hold? Asked by a restarted RC manager."""


class TakePath(Message, frozen=True):
    """An operator changed your owner's priority or place: ask by this path from now on, also a later RC manager."""

    path: Annotated[list[PathNode], FEW]


class CurrentRequest(Message, frozen=True):
    """Answer to ``AskRequest``.

    Attributes:
        request: As last sent.
        rcs: The set chosen for it; empty if none yet.
        epochs: What it holds; empty if the gate is closed.
        granted_s: Mission time of the grant; negative if the gate is closed.
    """

    request: SchedulingRequest
    rcs: Annotated[list[Mention], FEW]
    epochs: Annotated[dict[Mention, Epoch], FEW]
    granted_s: Instant


# ---------------------------------------------------------------------- to RCs
class Connect(Message, frozen=True):
    """Serve this ARC from now on.

    Attributes:
        arc: Name of the ARC.
        epoch: Larger than every earlier epoch of this RC.
        lease_s: Seconds of mission time after which the hold ends unless renewed.
        use: How the ARC uses this RC.
        companions: All RCs of the set with their epochs, so that RCs reached through another can be.
        rank: Place in the order of user priority among the holders, 0 first; for sharable RCs.
    """

    arc: Mention
    epoch: Epoch
    lease_s: LeaseSeconds
    use: RcUse
    companions: Annotated[dict[Mention, Epoch], FEW]
    rank: Rank = 0


class Connected(Message, frozen=True):
    """Answer to ``Connect``."""

    epoch: Epoch


class Disconnect(Message, frozen=True):
    """Stop serving this ARC: safe state, nothing queued survives. Right even if it is not connected."""

    arc: Mention
    epoch: Epoch
    reason: Text = ""


class Disconnected(Message, frozen=True):
    """Answer to ``Disconnect``: the safe state is reached.

    Attributes:
        last_epoch: Largest epoch this RC has seen.
    """

    last_epoch: Epoch


class AskRc(Message, frozen=True):
    """Who holds you?"""


class Holder(Message, frozen=True):
    """One ARC an RC serves."""

    arc: Mention
    epoch: Epoch
    since_s: Instant
    lease_until_s: Instant


class RcState(Message, frozen=True):
    """Answer to ``AskRc``: the truth about this resource.

    Attributes:
        name: The RC.
        kind: Its type.
        sharable: True if several ARCs may hold it.
        capacity: Share of its time it can give.
        holders: Who holds it now.
        last_epoch: Largest epoch it has seen.
        applied: Commands applied since its start.
        refused_stale: Commands of an older epoch or another ARC it refused.
        feedback: One line for people.
    """

    name: Mention
    kind: Mention
    sharable: bool
    capacity: Share
    holders: Annotated[list[Holder], MANY]
    last_epoch: Epoch
    applied: Count
    refused_stale: Count
    feedback: Text = ""


class Lease(Message, frozen=True):
    """One renewed hold.

    Attributes:
        rc: The RC.
        arc: Who holds it.
        epoch: Of the connection.
        rank: Place by user priority among those who hold a sharable RC now, 0 first; negative: as it was. It changes
            when others come and go, and with every change of priority.
    """

    rc: Mention
    arc: Mention
    epoch: Epoch
    rank: Rank = -1


class Leases(Message, frozen=True):
    """Published by the RC manager every ``RENEW_EVERY_S``: these holds last another ``lease_s`` from the stamp.

    An RC that knows better publishes its ``RcState``: one that does not have a hold any more which is
    renewed here, or one that is called missing.

    Attributes:
        leases: All holds that are renewed.
        lease_s: For how long, seconds of mission time.
        missing: RCs that do not answer, as far as the RC manager knows.
    """

    leases: Annotated[list[Lease], MANY]
    lease_s: LeaseSeconds
    missing: Annotated[list[Mention], MANY] = []


# ---------------------------------------------------------------------- for everybody
class AskSchedule(Message, frozen=True):
    """Who holds what, who waits?"""


class RcView(Message, frozen=True):
    """One RC in the master schedule.

    Attributes:
        rc: Its name.
        kind: Its type.
        state: ``up`` or ``down``.
        sharable: True if several ARCs may hold it.
        capacity: Share of its time it can give.
        holders: Who holds it, with epoch and since when.
        last_epoch: Largest epoch given so far.
        next: ARCs that get it, in the order of their predicted starts.
        until_s: Mission time at which the slice of each holder ends; negative: it is being disconnected.
        next_s: Mission times of their predicted starts, for each of ``next``.
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


class RequestView(Message, frozen=True):
    """One request in the master schedule.

    Attributes:
        arc: The ARC.
        owner: Its decision process.
        state: Where it is.
        rcs: Its RCs.
        since_s: Mission time at which it entered that state.
        until_s: End of its slice; negative if it holds nothing.
        expected_start_s: Predicted grant; negative if it runs or none can be predicted.
        because: One line: why it runs or waits.
        blockers: ARCs that stand directly in its way; ``why`` tells all that would have to go.
        minimum_runtime_s: As asked for.
        priority: Its priority path, for people: ``mission:10/surveillance:5/watch-scout1:3``.
        turns: Grants so far.
        rule: Rule of SCHEDULING.md that decides it.
        would_change: What would end this, for people.
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


class AskWhy(Message, frozen=True):
    """Why does this ARC, decision process or RC wait, run or stand idle?"""

    name: Mention


class Why(Message, frozen=True):
    """Answer to ``AskWhy``.

    Attributes:
        name: What was asked about.
        state: Where it is.
        lines: The reasons for people, most important first.
        rule: Rule of SCHEDULING.md that decides it.
        blockers: ARCs because of which; of a waiting one: without them it starts as soon as its RCs are up and free.
        expected_start_s: Predicted grant; negative if none.
        would_change: What would end the wait, for people.
    """

    name: Mention
    state: Mention
    lines: Annotated[list[Text], MANY]
    rule: Mention
    blockers: Annotated[list[Mention], MANY]
    expected_start_s: Instant
    would_change: Text


class AskAttributes(Message, frozen=True):
    """What is asked for by this ARC, by this decision process, or by all at and below this node?"""

    name: Mention


class RequestAttributes(Message, frozen=True):
    """What one ARC asks for, as it counts now.

    Attributes:
        arc: The ARC.
        owner: Address of its decision process.
        state: Where the request is.
        uses: RC → how it is used.
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


class TraceLine(Message, frozen=True):
    """Published as an event: one decision, in the trace format of the schedule."""

    line: Values


class SchedulingRefusal(Refusal):
    """The request cannot be scheduled, ever; nothing changed."""

    code = "scheduling.refused"
    remedy = "Change the request."


class MissingRuntime(SchedulingRefusal):
    """The request lacks a usable minimum run time."""

    code = "scheduling.minimum_runtime"
    remedy = "Give minimum_runtime_s of 1 ms to a day, and maximum_runtime_s of 0 or at least the minimum."


class UnknownRc(SchedulingRefusal):
    """The request names an RC that is not in the mission."""

    code = "scheduling.unknown_rc"
    remedy = "Use the names of 'scout-backbone status'."


class CapacityExceeded(SchedulingRefusal):
    """The demand does not fit the RC even alone; facts: ``demanded``, ``used``, ``free``."""

    code = "scheduling.capacity"
    remedy = "Ask for a longer period or fewer streams."


class UnknownRequest(SchedulingRefusal):
    """The RC manager knows no request, node or RC of this name."""

    code = "scheduling.unknown"
    remedy = "See 'scout-backbone status' for the names that are there."


class NotMovable(SchedulingRefusal):
    """The node cannot stand below that parent; nothing changed."""

    code = "scheduling.not_movable"
    remedy = "Name a node and a parent by the names of the priority paths that 'scout-backbone status' shows."


class FixedRules(Refusal):
    """The rules by which is scheduled do not change while the mission runs."""

    code = "scheduling.fixed_rules"
    remedy = "Change the parameters of the rc_manager in the mission file, and bring the mission up again."


class StaleEpoch(Refusal):
    """The epoch is older than the RC's, or the ARC does not hold it: nothing was applied."""

    code = "rc.stale"
    remedy = "Wait for the next grant; commands of an earlier one are never applied."


class Held(Refusal):
    """Another ARC holds the RC."""

    code = "rc.held"
    remedy = "Disconnect the holder first."


def most_epoch(now_s: float) -> int:
    """Return the largest epoch that can have been given by this mission time: an RC begins with the time of its start.

    Example:
        >>> most_epoch(2.5)
        1002500
    """
    return int(max(0.0, now_s) * EPOCHS_PER_S) + EPOCHS_AHEAD


RcManagerQuestion = (
    SchedulingRequest
    | Withdraw
    | SetIdle
    | ChangeRuntime
    | Extend
    | SetPriority
    | MoveNode
    | AskSchedule
    | AskWhy
    | AskAttributes
)
