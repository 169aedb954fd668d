"""Children: the rules by which a parent starts, stops and judges its children. Pure.

Events of children and the passing of time go in, instructions come out; the caller owns bus and clock.

Rules of this file:

* A child is *open* until it has finished and the parent has decided to leave it, or until another component ended it.
* After each event the rules compare the children that should run now (``wanted``) with the running ones.
* A child is stopped before it is started again; no child is started after the parent has finished. The parent finishes
at most once, after all started children are stopped.
* The children may change at any time. A new child counts as if it had been in the file from the beginning and had not
run yet; a removed child, as if it had never been in the file. A change does not interrupt a child that stays: if a new
child is put before a running one, it runs after it.

Source: SMC 2000, "Mission Control": behaviors spawn children; a finished child returns its status
to its parent, which decides what comes next.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar

import msgspec

from backbone.spoken import counted, value_text
from mission_control.messages import BehaviorStatus


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
    """The children have finished; the parent has this final status."""

    status: BehaviorStatus
    payload: Mapping[str, object] = field(default_factory=dict)


Instruction = StartChild | StopChild | FinishParent
BRANCH = "branch"
"""Key in the payload of a report: node → its state, for the nodes below the child."""


@dataclass(frozen=True, slots=True)
class Suspension:
    """A started child that has no grant.

    Attributes:
        because: Reason and cause, for people.
        since_s: Mission time of its first report.
    """

    because: str
    since_s: float


class ChildrenMemory(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The state of the rules from which the parent's next process continues.

    Attributes:
        names: All children, in the order of the mission file.
        open: The open children.
        status: Final status of the finished children.
        payload: Their last reports.
        suspensions: Started children that have no grant, if the parent's patience with them counts.
        verdict: Status with which the parent was about to finish.
        verdict_payload: The payload of that.
        stopping: Children whose end was ordered and not confirmed yet.
        begun_anew: Number of times that the parent began anew under the same order.
        stopped: Child → number of its ends; a child's order has an id of its own after each.
        ends: Number of the decided ends of the child; see ``composites.Again``.
        starts_at_s: Mission time of its next start.
        why_again: Why it starts again.
        skipped: Child → begin of the suspension for which it is not counted; see ``in_parallel``.
        sum_s: Sum of a stopwatch; see ``timed.Stopwatch``.
        since_s: Mission time since which it runs.
    """

    names: list[str] = []
    open: list[str] = []
    status: dict[str, BehaviorStatus] = {}
    payload: dict[str, dict[str, object]] = {}
    suspensions: dict[str, Suspension] = {}
    verdict: BehaviorStatus | None = None
    verdict_payload: dict[str, object] = {}
    stopping: list[str] = []
    begun_anew: int = 0
    stopped: dict[str, int] = {}
    ends: int = 0
    starts_at_s: float = -math.inf
    why_again: str = ""
    skipped: dict[str, float] = {}
    sum_s: float = 0.0
    since_s: float = math.inf


class Children:
    """The rules of a parent whose behavior decides on each finished child.

    Args:
        names: Names of the children, in the order of the mission file.
        together: True: all run at the same time; False: one after the other.
    """

    expects_failures: ClassVar[bool] = False
    """True: a failed child is part of the plan and raises no alarm; only a failed root does."""
    in_file_order: ClassVar[bool] = False
    """True: the drawing of the branch shows the children in the order of the mission file."""

    def __init__(self, names: Sequence[str], *, together: bool = True) -> None:
        self._names, self._together = tuple(names), together
        self._open, self._running = list(names), list[str]()
        self._has_begun = False
        self.has_finished = False
        """True once the parent has finished; from then on no instruction follows."""
        self.status: dict[str, BehaviorStatus] = {}
        self.payload: dict[str, Mapping[str, object]] = {}
        self.suspensions: dict[str, Suspension] = {}
        self._falls = dict[str, tuple[int, str]]()  # child → ends of its process in this run, and the last one
        self._verdict: FinishParent | None = None

    def decision(self, name: str) -> Decision:
        """Return the decision on a finished child: by default a failure aborts, a success continues."""
        return Decision.NEXT if self.status[name] is BehaviorStatus.SUCCESS else Decision.ABORT

    def wanted(self, now_s: float) -> list[str]:  # noqa: ARG002  for derived classes
        """Return the open children that should run now, in order."""
        return self._open if self._together else self._open[:1]

    def verdict(self, now_s: float) -> FinishParent | None:  # noqa: ARG002  for derived classes
        """Return the status with which the parent finishes now; None: it continues."""
        if self._open:
            return None
        failed = self._with_status(BehaviorStatus.FAILURE)
        if not failed:
            return FinishParent(BehaviorStatus.SUCCESS)
        return FinishParent(BehaviorStatus.FAILURE, {"failed": failed})

    @property
    def wakes_at_s(self) -> float:
        """Mission time at which the caller must call ``time_passed``; infinite: never."""
        return math.inf

    def begin(self, now_s: float) -> list[Instruction]:
        """Return the orders for the children that run first; none for a behavior without children."""
        self._has_begun = True
        return self._settle(now_s)

    def memory(self) -> ChildrenMemory:
        """Return the state from which ``resume`` continues."""
        finished = {name: status for name, status in self.status.items() if status.is_final and name not in self._open}
        memory = ChildrenMemory(
            names=list(self._names),
            open=list(self._open),
            status=finished,
            payload={name: dict(self.payload.get(name, {})) for name in finished},
        )
        if self._verdict is None:
            return memory
        verdict, payload = self._verdict.status, dict(self._verdict.payload)
        return msgspec.structs.replace(memory, verdict=verdict, verdict_payload=payload)

    def resume(self, memory: ChildrenMemory, now_s: float) -> None:
        """Continue from the state of an earlier process; call it before ``begin``.

        A child that ran then is started again, so the caller adopts it if it still runs. If its end was not decided, it
        is decided when the child reports it again.
        """
        names, self._names = self._names, tuple(memory.names)
        self._open, self.status, self.payload = list(memory.open), dict(memory.status), dict(memory.payload)
        self.suspensions = dict(memory.suspensions)
        if memory.verdict is not None:
            self._verdict = FinishParent(memory.verdict, memory.verdict_payload)
        self.rearranged(names, (), now_s)

    def rearranged(self, names: Sequence[str], anew: Collection[str], now_s: float) -> list[Instruction]:
        """Return the instructions after the children were changed.

        Args:
            names: Names of all children from now on, in the order of the mission file.
            anew: Names of children that begin again as new ones.
        """
        gone = [name for name in self._names if name not in names or name in anew]
        new = [name for name in names if name not in self._names or name in anew]
        stops: list[Instruction] = [StopChild(name) for name in reversed(self._running) if name in gone]
        for name in gone:
            for known in (self.status, self.payload, self.suspensions):
                known.pop(name, None)
        self._running = [name for name in self._running if name not in gone]
        self._names = tuple(names)
        if self.has_finished:
            return []
        still = [name for name in self._open if name not in gone]
        self._open = [name for name in still if name in self._running]
        self._open += [name for name in names if name in (*still, *new) and name not in self._running]
        return [*stops, *self._settle(now_s)] if self._has_begun else []

    def reported(self, name: str, status: BehaviorStatus, payload: Mapping[str, object]) -> bool:
        """Record a report; return True if the child has just finished and the parent must decide."""
        if name not in self._running or self.has_finished or self.status[name].is_final:
            return False
        self.status[name], self.payload[name] = status, payload
        if status.is_final:
            self.suspensions.pop(name, None)
        return status.is_final

    def fell(self, name: str, how: str) -> None:
        """Record that the process of a running child ended and is restarted; this is not a failure of the child."""
        if name in self._running and not self.status[name].is_final:
            self._falls[name] = (self._falls[name][0] + 1, how)

    def decided(self, name: str, decision: Decision, now_s: float) -> list[Instruction]:
        """Return the instructions after the parent's decision about a finished child."""
        if self.has_finished or name not in self._running or not self.status[name].is_final:
            return []
        match decision:
            case Decision.RETRY:
                self._running.remove(name)
                del self.status[name]
                return [StopChild(name), *self._arrange(now_s)]
            case Decision.ABORT:
                return self._finish(FinishParent(BehaviorStatus.FAILURE, {"child": name, **self.payload[name]}))
            case Decision.NEXT:
                self._running.remove(name)
                self._open.remove(name)
                return [StopChild(name), *self._arrange(now_s)]

    def suspended(self, name: str, because: str, now_s: float) -> list[Instruction]:
        """Return the instructions after a report of a child about its grant.

        Args:
            because: Reason and cause of the suspension; empty: it is at work.
        """
        if name not in self._running or self.has_finished or self.status[name].is_final:
            return []
        before = self.suspensions.pop(name, None)
        if because:
            self.suspensions[name] = Suspension(because, now_s if before is None else before.since_s)
        return self._arrange(now_s)

    def time_passed(self, now_s: float) -> list[Instruction]:
        """Return the instructions that are due now."""
        return self._arrange(now_s) if self._open else []

    def left(self, name: str, now_s: float) -> list[Instruction]:
        """Return the instructions after another component ended a child; the child no longer counts."""
        if self.has_finished or name not in self._running:
            return []
        self._running.remove(name)
        self._open.remove(name)
        del self.status[name]
        self.suspensions.pop(name, None)
        return self._arrange(now_s)

    def end(self) -> list[Instruction]:
        """Return the orders that end all started children."""
        self.has_finished = True
        stops: list[Instruction] = [StopChild(name) for name in reversed(self._running)]
        self._running, self._open = [], []
        self.suspensions = {}
        return stops

    def is_running(self, name: str) -> bool:
        """Return whether the child is started, and was not left since."""
        return name in self._running

    @property
    def suspended_because(self) -> str:
        """Why no started child is at work; empty: a child is at work, or none is started."""
        waiting = [name for name in self._running if name in self.suspensions]
        if not waiting or len(waiting) < len(self._running):
            return ""
        return ", ".join(f"{name}: {self.suspensions[name].because}" for name in waiting)

    @property
    def sentence(self) -> str:
        """Text about the running children and the reason; empty: no text."""
        return ""

    def remarks(self) -> dict[str, str]:
        """Return node → its state, for the drawing of the branch."""
        remarks = {name: self._remark(name) for name in self.status}
        for name, status in self.status.items():
            below = {} if status.is_final or self.has_finished else self.payload.get(name, {}).get(BRANCH)
            remarks |= below if isinstance(below, dict) else {}
        return remarks

    def why_failed(self, name: str) -> str:
        """Return the failure of a child as part of a sentence.

        Example:
            >>> children = Children(["hide"])
            >>> children.payload["hide"] = {"looks": 20}
            >>> children.why_failed("hide")
            'hide failed (looks 20)'
        """
        payload = self.payload.get(name, {})
        if "detail" in payload:
            return f"{name} failed: {payload['detail']}"
        given = ", ".join(f"{word} {value_text(value)}" for word, value in payload.items())
        return f"{name} failed ({given})" if given else f"{name} failed"

    def _settle(self, now_s: float) -> list[Instruction]:
        """Arrange the children; without children there are no instructions."""
        return self._arrange(now_s) if self._names else []

    def _remark(self, name: str) -> str:
        if name in self.suspensions:
            return f"suspended: {self.suspensions[name].because}"
        if self.status[name].is_final:
            return str(self.status[name])
        return "ended" if self.has_finished else ", ".join(filter(None, (self.status[name], self._restarts(name))))

    def _restarts(self, name: str) -> str:
        """Return the restarts of a running child as the end of a sentence; empty: there was none."""
        number, how = self._falls[name]
        return f"restarted {counted(number, 'time')}, last after {how}" if number else ""

    def _with_status(self, status: BehaviorStatus) -> list[str]:
        return [name for name in self._names if self.status.get(name) is status]

    def _arrange(self, now_s: float) -> list[Instruction]:
        """If there is a verdict, finish. Otherwise stop and start children so that the wanted ones run."""
        if self.has_finished:
            return []
        verdict = self._verdict or self.verdict(now_s)
        if verdict is not None:
            return self._finish(verdict)
        wanted = self.wanted(now_s)
        stopping = [name for name in reversed(self._running) if name not in wanted]
        starting = [name for name in wanted if name not in self._running]
        for name in stopping:
            self._running.remove(name)
            del self.status[name]
            self.suspensions.pop(name, None)
        self._running += starting
        self.status |= dict.fromkeys(starting, BehaviorStatus.RUNNING)
        self._falls |= dict.fromkeys(starting, (0, ""))
        return [*map(StopChild, stopping), *map(StartChild, starting)]

    def _finish(self, finish: FinishParent) -> list[Instruction]:
        self._verdict = finish
        return [*self.end(), finish]
