"""Events and instructions: the input and the output of the schedule manager.

Rules of this file: plain frozen data; no bus, no clock. Times are mission seconds.
An event reports a fact of the past. Instructions are carried out in the given order, and their outcomes are reported as
events. Events are messages, because recordings contain them: the same events lead to the same decisions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from backbone.ranges import FEW, MANY, Duration, Epoch, Instant, Mention, Priority, RunTime, Share, Text
from backbone.scheduling.requests import MeasuredPackets, PathNode, RcUse, SchedulingRequest
from backbone.scheduling.trace import Line
from backbone.wire import Message


class RcKnown(Message, frozen=True):
    """An RC exists; repeated after its restart.

    Attributes:
        kind: Its type, for people.
        capacity: Share of its time it can give, 0 to 1.
        connect_s: Settling time.
        disconnect_s: Release time.
        up: True if its RC answers.
        last_epoch: Largest epoch it has seen.
        is_robot: True if it is a robot, for people.
    """

    rc: Mention
    kind: Mention
    sharable: bool
    capacity: Share
    connect_s: Duration
    disconnect_s: Duration
    up: bool
    last_epoch: Epoch
    is_robot: bool = False


class RcWentDown(Message, frozen=True):
    """The RC does not answer any more, or is not credible.

    Attributes:
        fault: Its contradiction; empty: it does not answer.
    """

    rc: Mention
    fault: Text = ""


class RcRemoved(Message, frozen=True):
    """The RC is no longer among the hardware. It counts until it is down and no request names it."""

    rc: Mention


class RcCameBack(Message, frozen=True):
    """The RC answers again, without holders."""

    rc: Mention
    last_epoch: Epoch


class CapacityChanged(Message, frozen=True):
    """The capacity of a sharable RC has changed."""

    rc: Mention
    capacity: Share


class PacketsMeasured(Message, frozen=True):
    """A sharable RC measured packets that take longer than their ARCs declared.

    Attributes:
        packets: Each kind of packets of an ARC at most once.
    """

    rc: Mention
    packets: Annotated[list[MeasuredPackets], MANY]


class Requested(Message, frozen=True):
    """An ARC sent a request; the set of RCs is already chosen (``choose`` in the schedule manager).

    Attributes:
        others_follow: True: requests that are as old follow, so a decision must wait for the last of them.
    """

    request: SchedulingRequest
    rcs: Annotated[tuple[Mention, ...], FEW]
    others_follow: bool = False


class Adopted(Message, frozen=True):
    """A restarted RC manager found an ARC that still holds its RCs by leases. Event time: their connection.

    Attributes:
        overtaken: Its RCs that another ARC was connected to later, and granted earlier because it settled faster.
    """

    request: SchedulingRequest
    epochs: Annotated[dict[Mention, Epoch], FEW]
    granted_s: Instant
    overtaken: Annotated[list[Mention], FEW] = []


class Wanted(Message, frozen=True):
    """An idle ARC wants time again."""

    arc: Mention


class Idled(Message, frozen=True):
    """An ARC wants no time now but keeps its request."""

    arc: Mention


class Departed(Message, frozen=True):
    """An ARC withdrew or died.

    Attributes:
        why: Reason, for the trace: ``self``, ``owner``, ``dead``.
    """

    arc: Mention
    why: Mention = "self"


class RuntimeChanged(Message, frozen=True):
    """An ARC asked for other run times."""

    arc: Mention
    minimum_runtime_s: RunTime
    maximum_runtime_s: RunTime


class Extended(Message, frozen=True):
    """A running ARC asked to continue until this time."""

    arc: Mention
    until_s: Instant


class PriorityChanged(Message, frozen=True):
    """A node of the tree, or a console, has another priority."""

    node: Mention
    priority: Priority


class NodeMoved(Message, frozen=True):
    """A node of the tree, with its descendants, is now below another parent."""

    node: Mention
    parent: Mention


class Moved(Message, frozen=True):
    """A node that was moved.

    Attributes:
        before: Names from the root to its former place.
        now: Names from the root to its new place.
    """

    before: Annotated[list[Mention], FEW]
    now: Annotated[list[Mention], FEW]


class KeptTree(Message, frozen=True):
    """Operators set these numbers and places at an earlier RC manager; the first event of a later one.

    Attributes:
        priorities: Node or console → its number.
        moves: The moves, in their order.
        nodes: Path of each node, if nodes were moved: a moved node can be named before the nodes above it.
    """

    priorities: Annotated[dict[Mention, Priority], MANY] = {}
    moves: Annotated[list[Moved], MANY] = []
    nodes: Annotated[list[Annotated[list[PathNode], FEW]], MANY] = []


class Opened(Message, frozen=True):
    """The ARC's RCs are connected and settled, its gate is open."""

    arc: Mention


class OpenFailed(Message, frozen=True):
    """The ARC's RCs could not all be connected; all of them were disconnected again.

    Attributes:
        rc: The RC that failed, empty if it was the ARC.
    """

    arc: Mention
    rc: Mention


class Freed(Message, frozen=True):
    """All RCs of the ARC are disconnected, in their safe states."""

    arc: Mention


class Woken(Message, frozen=True):
    """The time of the last ``WakeAt`` has come."""


Event = (
    RcKnown
    | RcWentDown
    | RcRemoved
    | RcCameBack
    | CapacityChanged
    | PacketsMeasured
    | Requested
    | Adopted
    | Wanted
    | Idled
    | Departed
    | RuntimeChanged
    | Extended
    | PriorityChanged
    | NodeMoved
    | KeptTree
    | Opened
    | OpenFailed
    | Freed
    | Woken
)


@dataclass(frozen=True, slots=True)
class ConnectArc:
    """Connect all these RCs to the ARC, let them settle, open its gate; report ``Opened`` or ``OpenFailed``.

    Attributes:
        epochs: RC → epoch; larger than all before.
        settle_s: Longest settling time of the set.
        until_s: End of the minimum run time if the grant comes right after settling.
        ranks: Sharable RC → place of this ARC among its holders by user priority, 0 first.
        uses: RC → how the ARC uses it, as it declared; exclusively for missing ones.
    """

    arc: str
    epochs: Mapping[str, int]
    settle_s: float
    until_s: float
    ranks: Mapping[str, int] = field(default_factory=dict)
    uses: Mapping[str, RcUse] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RevokeArc:
    """Close the ARC's gate and disconnect its RCs; report ``Freed``.

    Attributes:
        epochs: RC → epoch it held.
        why: ``slice``, ``higher``, ``rc``, ``self``, ``owner``, ``dead``, ``capacity``, ``failed``, ``packets``.
        by: ARC or RC that caused it; empty for ``self``.
        deadline_s: Seconds that its decision process has to stop cleanly; 0: none.
        expected_s: Predicted next grant; negative: none.
    """

    arc: str
    epochs: Mapping[str, int]
    why: str
    by: str
    deadline_s: float
    expected_s: float


@dataclass(frozen=True, slots=True)
class WakeAt:
    """Report ``Woken`` at this time; replaces the last ``WakeAt``. ``None``: do not report."""

    at_s: float | None


@dataclass(frozen=True, slots=True)
class Record:
    """Write this line to the trace, in this order.

    Attributes:
        line: The line, in the format of SCHEDULING.md, section 5.
        cause: One line for people, about the rule that decided.
    """

    line: Line
    cause: str = ""


@dataclass(frozen=True, slots=True)
class RenewLeases:
    """Renew all leases now: the places of holders on a sharable RC have changed."""


Instruction = ConnectArc | RevokeArc | WakeAt | RenewLeases | Record
