"""Messages between the RC manager, the RCs and the ARCs, and questions of others to the RC manager.

Senders and receivers:

* ARC → RC manager: ``SchedulingRequest``, ``Withdraw``, ``SetIdle``, ``ChangeRuntime``, ``Extend``.
* RC manager → ARC: ``OpenGate``, ``CloseGate``, ``AskRequest``.
* RC manager → RC: ``Connect``, ``Disconnect``, ``AskRc``; ``Leases`` as a publication.
* any component → RC manager: ``AskSchedule``, ``AskWhy``, ``AskAttributes``, ``AskUtilization``, ``SetPriority``,
  ``MoveNode``.
"""

from __future__ import annotations

from typing import Annotated

from backbone.errors import Refusal
from backbone.ranges import (
    FEW,
    MANY,
    Count,
    Duration,
    Epoch,
    Instant,
    LeaseSeconds,
    Mention,
    Name,
    Priority,
    Quoted,
    Rank,
    RunTime,
    Share,
    Text,
    Values,
)
from backbone.scheduling.events import Event
from backbone.scheduling.requests import Holder, Lease, MeasuredPackets, RcUse, SchedulingRequest
from backbone.wire import Message

RENEW_EVERY_S = 0.5  # chosen: three renewals may be lost
EPOCHS_PER_S = 1000  # chosen: no RC changes its holder so often, so a restarted RC begins above its earlier epochs
EPOCHS_AHEAD = 1_000_000  # chosen: clocks of two hosts differ by less than 1000 s
BEAT_WITHIN_S = 0.7  # chosen: an ARC beats after each renewal, or, without renewals, so long after its last beat
BEAT_MISSED_S = 1.2  # chosen: one of two expected beats may be lost; a hung ARC is found at the third renewal, at 1.5 s
LONGEST_PACKET_S = 10.0  # chosen: a radio abandons a packet after a second; a longer time is a fault of its driver


# Requests of ARCs.


class Withdraw(Message, frozen=True):
    """This ARC needs no more time and is about to end."""

    arc: Mention
    reason: Text = ""


class SetIdle(Message, frozen=True):
    """Keep the request but free the RCs (idle), or queue it again (not idle)."""

    arc: Mention
    idle: bool


class ChangeRuntime(Message, frozen=True):
    """Ask for other run times from the next slice on."""

    arc: Mention
    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime = 0.0


class Extend(Message, frozen=True):
    """Extend the running slice to this mission time, at most to grant + maximum run time."""

    arc: Mention
    until_s: Instant


class SetPriority(Message, frozen=True):
    """Set the priority of a node of the behavior tree, or of a console, among its siblings."""

    node: Mention
    priority: Priority


class MoveNode(Message, frozen=True):
    """Move a node of the behavior tree, with its descendants, below another parent; its priority stays."""

    node: Mention
    parent: Mention


class Done(Message, frozen=True):
    """Answer to a request that has no other answer: it was carried out."""


class Beat(Message, frozen=True):
    """Heartbeat of an ARC and its owner; the ARC publishes it under ``Conversation.BEAT`` after each ``Leases``."""

    arc: Name


# To ARCs.


class OpenGate(Message, frozen=True):
    """The ARC's RCs are connected: prepare them, wait until they have settled, then let commands pass.

    Attributes:
        epochs: RC name → epoch of this connection.
        settled_s: Mission time at which the RCs have settled, counted from the order to connect.
        until_s: Earliest end of the slice, mission time, if it began now.
    """

    epochs: Annotated[dict[Mention, Epoch], FEW]
    settled_s: Instant
    until_s: Instant


class GateOpens(Message, frozen=True):
    """Answer to ``OpenGate``: all is prepared; commands pass from ``settled_s`` on, and the owner gets ``Resumed``."""


class CloseGate(Message, frozen=True):
    """Close the gate.

    Attributes:
        reason: Reason: ``slice``, ``higher``, ``rc``, ``self`` …
        by: ARC or RC that caused it.
        deadline_s: Seconds that the decision process has to stop cleanly; 0: none, because a higher one preempts it.
        expected_s: Mission time of the next expected slot; negative: unknown.
    """

    reason: Text
    by: Mention
    deadline_s: Duration
    expected_s: Instant


class GateClosed(Message, frozen=True):
    """Answer to ``CloseGate``: the gate is closed."""


class AskRequest(Message, frozen=True):
    """A restarted RC manager asks an ARC for its request and its holds."""


class CurrentRequest(Message, frozen=True):
    """Answer to ``AskRequest``.

    Attributes:
        request: The request as last sent.
        rcs: The set chosen for it; empty if none was chosen yet.
        epochs: RC → epoch of each hold; empty if the gate is closed.
        granted_s: Mission time of the grant; negative if the gate is closed.
        waits_since_s: Mission time of its place in line: of its request, or of the end of its last whole slice.
        extended_until_s: Mission time until which its owner extended its present slice; 0: not extended.
    """

    request: SchedulingRequest
    rcs: Annotated[list[Mention], FEW]
    epochs: Annotated[dict[Mention, Epoch], FEW]
    granted_s: Instant
    waits_since_s: Instant = 0.0
    extended_until_s: Instant = 0.0


# To RCs.


class Connect(Message, frozen=True):
    """Serve this ARC from now on.

    Attributes:
        epoch: Larger than every earlier epoch of this RC.
        lease_s: Seconds of mission time after which the hold ends unless renewed.
        use: The ARC's use of this RC.
        companions: All RCs of the set with their epochs, for RCs that are reached through another one.
        rank: Place in the order of user priority among the holders, 0 first; for sharable RCs.
    """

    arc: Name
    epoch: Epoch
    lease_s: LeaseSeconds
    use: RcUse
    companions: Annotated[dict[Mention, Epoch], FEW]
    rank: Rank = 0


class Connected(Message, frozen=True):
    """Answer to ``Connect``."""

    epoch: Epoch


class Disconnect(Message, frozen=True):
    """Stop serving this ARC: safe state, no queued command survives. Valid also if it is not connected."""

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
    """Ask an RC for its state."""


class RcState(Message, frozen=True):
    """Answer to ``AskRc``: the state of this RC, which is the truth.

    Attributes:
        sharable: True if several ARCs may hold it.
        capacity: Share of its time it can give.
        holders: Its present holders.
        last_epoch: Largest epoch it has seen.
        applied: Commands applied since its start.
        refused_stale: Commands of an older epoch or another ARC it refused.
        feedback: One line for people.
        measured: Packets of present holders that take longer than declared; each kind of packets of an ARC at most
            once.
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
    measured: Annotated[list[MeasuredPackets], MANY] = []


class Leases(Message, frozen=True):
    """Published by the RC manager every ``RENEW_EVERY_S``: these holds are renewed for ``lease_s`` from the stamp on.

    An RC that lost a hold renewed here, or that is listed as missing, publishes its ``RcState``.

    Attributes:
        lease_s: Duration of the leases, seconds of mission time.
        missing: RCs that do not answer the RC manager.
    """

    leases: Annotated[list[Lease], MANY]
    lease_s: LeaseSeconds
    missing: Annotated[list[Mention], MANY] = []


# For any component.


class AskSchedule(Message, frozen=True):
    """Ask for the schedule."""


class AskWhy(Message, frozen=True):
    """Ask why this ARC, decision process or RC waits, runs or is idle."""

    name: Mention


class AskUtilization(Message, frozen=True):
    """Ask for the utilization of each RC.

    Attributes:
        periods: True: the answer includes the ARCs' shares between the last re-plannings.
    """

    periods: bool = False


class AskAttributes(Message, frozen=True):
    """Ask for the requests of this ARC, of this decision process, or of this node and its descendants."""

    name: Mention


class TraceLine(Message, frozen=True, tag="TraceLine/2"):
    """Published as an event: one decision, in the trace format of the schedule.

    Attributes:
        cause: One line for people, about the rule that decided.
    """

    line: Values
    cause: Text = ""


class Decided(Message, frozen=True):
    """The schedule manager decided on an event. The same events in the same order lead to the same decisions.

    Attributes:
        number: Grows by one with each; 1 is the first of an RC manager.
        at_s: Mission time of the decision.
    """

    number: Count
    at_s: Instant
    event: Event


class AskSnapshot(Message, frozen=True):
    """Ask for all that the schedule manager decides by."""


class ScheduleSnapshot(Message, frozen=True):
    """Answer to ``AskSnapshot``; also published before the first decision of an RC manager.

    Attributes:
        number: Of the last decision; 0: there was none.
        at_s: Mission time.
        state: See ``backbone.scheduling.snapshot``.
    """

    number: Count
    at_s: Instant
    state: Quoted


class FixedRules(Refusal):
    """The scheduling rules do not change while the mission runs."""

    code = "scheduling.fixed_rules"
    remedy = "Change the parameters of the rc_manager in the mission file, and bring the mission up again."


class NotThatArc(Refusal):
    """Only an ARC itself sends, changes and withdraws its request. Nothing is changed."""

    code = "scheduling.not_that_arc"
    remedy = "Ask the ARC; it sends its own requests to the RC manager."


class StaleEpoch(Refusal):
    """The epoch is older than the RC's, or the ARC does not hold it: nothing was applied."""

    code = "rc.stale"
    remedy = "Wait for the next grant; commands of an earlier one are never applied."


class Held(Refusal):
    """Another ARC holds the RC."""

    code = "rc.held"
    remedy = "Disconnect the holder first."


def most_epoch(now_s: float) -> int:
    """Return the largest epoch possible at this mission time: an RC's epochs begin with the time of its start.

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
    | AskUtilization
    | AskSnapshot
)
