"""The behavior tree: nodes with priorities, and a parent's decisions about its children.

Rules of this file: no bus, no clock. A priority counts among siblings only; the RC manager compares two nodes by their
paths from the root.

Source: SMC 2000, "Mission Control": behaviors spawn children; a finished child returns its status
to its parent, which decides what comes next.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import msgspec

from backbone.mission.behavior_orders import PathStep, behavior_order
from backbone.placer.messages import Start
from mission_control.messages import BehaviorStatus


class ArcNeed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ARC a behavior claims.

    Attributes:
        kind: Component type of the ARC.
        minimum_runtime_s: Shortest useful time, seconds, above 0.
        wish: Role → name wanted.
        features: Role → features wanted.
        maximum_runtime_s: End of extensions, seconds; 0: the minimum.
        period_s: Interval between radio packets, seconds.
        packet_time_s: Air time of one packet, seconds.
    """

    kind: str
    minimum_runtime_s: float
    wish: dict[str, str] = {}
    features: dict[str, list[str]] = {}
    maximum_runtime_s: float = 0.0
    period_s: float = 0.05
    packet_time_s: float = 0.002


class BehaviorNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A node of the tree, with its branch.

    Attributes:
        name: Name of the node and of its component.
        priority: Among its siblings; larger is higher.
        arc: The ARC that it claims, if any.
        process: Name of its shared process; empty: a process of its own.
    """

    type: str
    name: str
    priority: int
    parameters: dict[str, Any] = {}
    arc: ArcNeed | None = None
    children: list[BehaviorNode] = []
    process: str = ""

    def order(self, parent_path: Sequence[PathStep]) -> Start:
        """Return the order that starts this node under a parent with that path."""
        plain: dict[str, object] = msgspec.to_builtins(self)
        return behavior_order(plain, parent_path)


def walk(nodes: Sequence[BehaviorNode], path: Sequence[PathStep] = ()) -> Iterator[tuple[list[PathStep], BehaviorNode]]:
    """Yield every node with its path, parents before their children, in the given order."""
    for node in nodes:
        own = [*path, (node.name, node.priority)]
        yield own, node
        yield from walk(node.children, own)


def draw(nodes: Sequence[BehaviorNode], remarks: Mapping[str, str] | None = None) -> str:
    """Return the tree as text, one line a node, siblings of higher priority first.

    Args:
        nodes: The roots.
        remarks: Name of a node → remark behind it.

    Example:
        >>> leaf = BehaviorNode("watch_for_motion", "watch1", 3)
        >>> print(draw([BehaviorNode("surveillance", "watch", 5, children=[leaf])], {"watch1": "running"}))
        watch (surveillance, priority 5)
        └─ watch1 (watch_for_motion, priority 3): running
    """
    return "\n".join(_lines(nodes, remarks or {}, ""))


def _lines(nodes: Sequence[BehaviorNode], remarks: Mapping[str, str], margin: str, root: bool = True) -> Iterator[str]:
    ordered = sorted(nodes, key=lambda node: -node.priority)
    for node in ordered:
        last = node is ordered[-1]
        branch, below = ("", "") if root else ("└─ ", "   ") if last else ("├─ ", "│  ")
        remark = f": {remarks[node.name]}" if remarks.get(node.name) else ""
        yield f"{margin}{branch}{node.name} ({node.type}, priority {node.priority}){remark}"
        yield from _lines(node.children, remarks, margin + below, root=False)


# ---------------------------------------------------------------------- a parent and its children
class Decision(StrEnum):
    """A parent's decision about a finished child."""

    RETRY = "retry"  # start the same child again, from its beginning
    NEXT = "next"  # leave it; continue with the other children
    ABORT = "abort"  # stop all children; the parent has failed


@dataclass(frozen=True, slots=True)
class StartChild:
    """Start this child."""

    name: str


@dataclass(frozen=True, slots=True)
class StopChild:
    """End this child. Idempotent."""

    name: str


@dataclass(frozen=True, slots=True)
class FinishParent:
    """The children have finished: the parent has this final status."""

    status: BehaviorStatus
    payload: Mapping[str, object] = field(default_factory=dict)


Instruction = StartChild | StopChild | FinishParent


class Children:
    """Turns events of children into instructions for their parent.

    Laws: a child is stopped before it is started again; no child is started after the parent has
    finished; the parent finishes at most once.

    Args:
        names: Names of the children, in the order of the mission file.
        together: True: all run at the same time; False: one after the other.
    """

    def __init__(self, names: Sequence[str], *, together: bool = True) -> None:
        self._waiting, self._together = list(names), together
        self._running: list[str] = []
        self._finished = False
        self.status: dict[str, BehaviorStatus] = {}
        self.payload: dict[str, Mapping[str, object]] = {}

    def begin(self) -> list[Instruction]:
        """Return the orders for the children that run first."""
        return self._start_next()

    def reported(self, name: str, status: BehaviorStatus, payload: Mapping[str, object]) -> bool:
        """Record a report; return True if the child has newly finished and the parent must decide."""
        if name not in self._running or self._finished or self.status[name].is_final:
            return False
        self.status[name], self.payload[name] = status, payload
        return status.is_final

    def decided(self, name: str, decision: Decision) -> list[Instruction]:
        """Return the instructions after the parent's decision about a finished child."""
        if self._finished or name not in self._running or not self.status[name].is_final:
            return []
        match decision:
            case Decision.RETRY:
                self.status[name] = BehaviorStatus.RUNNING
                return [StopChild(name), StartChild(name)]
            case Decision.ABORT:
                stops = self.end()
                return [*stops, FinishParent(BehaviorStatus.FAILURE, {"child": name, **self.payload[name]})]
            case Decision.NEXT:
                self._running.remove(name)
                return [StopChild(name), *self._start_next(), *self._finish_if_done()]

    def left(self, name: str) -> list[Instruction]:
        """Return the instructions after another component ended a child: the child is not started again."""
        if self._finished or name not in self._running:
            return []
        self._running.remove(name)
        del self.status[name]
        return [*self._start_next(), *self._finish_if_done()]

    def end(self) -> list[Instruction]:
        """Return the orders that end all started children."""
        self._finished = True
        stops: list[Instruction] = [StopChild(name) for name in reversed(self._running)]
        self._running, self._waiting = [], []
        return stops

    def _start_next(self) -> list[Instruction]:
        if self._finished or (self._running and not self._together):
            return []
        count = len(self._waiting) if self._together else 1
        starting, self._waiting = self._waiting[:count], self._waiting[count:]
        self._running += starting
        self.status |= dict.fromkeys(starting, BehaviorStatus.RUNNING)
        return [StartChild(name) for name in starting]

    def _finish_if_done(self) -> list[Instruction]:
        if self._running or self._waiting:
            return []
        self._finished = True
        failed = [name for name, status in self.status.items() if status is BehaviorStatus.FAILURE]
        status = BehaviorStatus.FAILURE if failed else BehaviorStatus.SUCCESS
        return [FinishParent(status, {"failed": failed} if failed else {})]
