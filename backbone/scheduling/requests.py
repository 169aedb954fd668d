"""Messages of requests: an ARC's demand, the RC manager's answer, and the refusals."""

from __future__ import annotations

from collections.abc import Collection, Mapping
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
    Mention,
    Name,
    Period,
    Priority,
    Rank,
    RunTime,
)
from backbone.wire import Message

LEASE_S = 2.0  # chosen: longer than a restart of hub or RC manager (under 1 s), but an orphan's hold ends soon


class Usage(Message, frozen=True):
    """A periodic stream on a sharable RC (RAM 2002, "Sharable Resources": usage parameter).

    Attributes:
        period_s: Constant interval between requests.
        packet_time_s: Duration of one request.
        deadline_s: Time from its release to its deadline; 0: the period.
        jitter_s: Largest delay of its release.
        kind: Kind of the requests, for people (``drive``).
    """

    period_s: Period
    packet_time_s: Period
    deadline_s: Duration = 0.0
    jitter_s: Period = 0.0
    kind: Mention = ""


class MeasuredPackets(Message, frozen=True):
    """Packets that take longer on the air than their ARC declared.

    Attributes:
        kind: Kind of their stream, as in the request.
        packet_time_s: Longest measured time of such a packet, above 0, seconds.
    """

    arc: Mention
    kind: Mention
    packet_time_s: Period


class RcUse(Message, frozen=True):
    """An ARC's use of one RC: exclusive, or by streams on a sharable one.

    Attributes:
        streams: Its streams; none means exclusive.
    """

    streams: Annotated[list[Usage], FEW_STREAMS] = []


class PathNode(Message, frozen=True):
    """A node on the path from the root to a decision process."""

    name: Name
    priority: Priority


class SchedulingRequest(Message, frozen=True):
    """An ARC's request for run time (RAM 2002, "The RC Scheduler").

    Attributes:
        path: Nodes from the mission's root (or the console itself) to the decision process.
        console: True if the owner is a console: its path is a sibling of the mission's root.
        alternatives: Acceptable sets of RCs, best first: RC name → use.
        minimum_runtime_s: Shortest useful time, above 0.
        maximum_runtime_s: End of all extensions, at least the minimum; 0: the minimum.
        idle: True: the request exists, but wants no time now.
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

    def uses_of(self, rcs: Collection[str]) -> Mapping[str, RcUse]:
        """Return the alternative of these RCs; exclusive uses if it is none."""
        return next((wish for wish in self.alternatives if wish.keys() == {*rcs}), {rc: RcUse() for rc in rcs})


class RequestState(StrEnum):
    """State of a request."""

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
        blockers: ARCs that block it directly; ``why`` names all that would have to be revoked.
        expected_start_s: Mission time of the predicted grant; negative: none can be predicted.
    """

    rcs: Annotated[list[Mention], FEW]
    state: RequestState
    position: Count
    blockers: Annotated[list[Mention], MANY]
    expected_start_s: Instant


class Holder(Message, frozen=True):
    """One ARC an RC serves."""

    arc: Name
    epoch: Epoch
    since_s: Instant
    lease_until_s: Instant


class Lease(Message, frozen=True):
    """A renewed hold.

    Attributes:
        arc: Its holder.
        epoch: Epoch of the connection.
        rank: Place by user priority among the present holders of a sharable RC, 0 first; negative: unchanged. It
            changes when others come and go, and with every change of priority.
    """

    rc: Mention
    arc: Mention
    epoch: Epoch
    rank: Rank = -1


class SchedulingRefusal(Refusal):
    """The request can never be scheduled; nothing changed."""

    code = "scheduling.refused"
    remedy = "Change the request."


class MissingRuntime(SchedulingRefusal):
    """The request lacks a usable minimum run time."""

    code = "scheduling.minimum_runtime"
    remedy = "Give minimum_runtime_s of 1 ms to a day, and maximum_runtime_s of 0 or at least the minimum."


class UnknownRc(SchedulingRefusal):
    """The request names an RC that is not in the mission."""

    code = "scheduling.unknown_rc"
    remedy = "Use the names that 'scout-backbone resources' lists."


class CapacityExceeded(SchedulingRefusal):
    """The demand does not fit the RC even alone; facts: ``demanded``, ``used``, ``free``."""

    code = "scheduling.capacity"
    remedy = "Ask for a longer period or fewer streams."


class UnknownRequest(SchedulingRefusal):
    """The RC manager knows no request, node or RC of this name."""

    code = "scheduling.unknown"
    remedy = "See 'scout-backbone status' for the present names."


class NotMovable(SchedulingRefusal):
    """The node cannot be moved below that parent; nothing changed."""

    code = "scheduling.not_movable"
    remedy = "Name a node and a parent by the names of the priority paths that 'scout-backbone status' shows."
