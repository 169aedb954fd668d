"""Composites: the rules of parents that the mission file composes; events go in, instructions come out. Pure.

Names and meanings are those of BehaviorTree.CPP 4, with three differences:

* There are no ticks. A child is a process of its own that sends reports; every rule is applied at an event.
* A child may be suspended at any time, because its ARC has no grant. By default the parent waits for it.
``while_suspended`` sets another reaction where that makes sense.
* If another component (an operator, say) ended a child, the rules treat it as if the file had no such child.
BehaviorTree.CPP calls this *skipped*.

Each rule reads its settings when it is applied, so that the owner may change them at any time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from enum import StrEnum
from typing import ClassVar

import msgspec

from mission_control.children import Children, ChildrenMemory, Decision, FinishParent, Instruction
from mission_control.messages import BehaviorStatus

ENDLESS = -1
"""As a number of cycles or attempts: endless; as a threshold: all children."""


class WhileSuspended(StrEnum):
    """Reaction of a parent to a suspended child."""

    WAIT = "wait"  # the parent waits for the child, and its time does not run
    COUNT = "count"  # its time runs on
    NEXT = "next"  # the next alternative replaces the child until the child is at work again
    FAIL = "fail"  # the child is ended and counts as failed
    SKIP = "skip"  # the child is not counted until it is at work again


class Composite(Children):
    """A parent that decides by rules alone. Without children it finishes at once.

    With ``WhileSuspended.FAIL``, a child that was suspended for ``patience_s`` without a break counts as failed. At one
    instant, reports of children come before the end of the patience.
    """

    expects_failures = True
    in_file_order = True

    def __init__(
        self,
        names: Sequence[str],
        *,
        while_suspended: WhileSuspended = WhileSuspended.WAIT,
        patience_s: float = 0.0,
        together: bool = False,
    ) -> None:
        super().__init__(names, together=together)
        self.while_suspended, self.patience_s = while_suspended, patience_s

    def memory(self) -> ChildrenMemory:
        """Return the state, with the suspensions if the patience counts; see ``Children.memory``."""
        memory = super().memory()
        if self.while_suspended in (WhileSuspended.WAIT, WhileSuspended.COUNT):
            return memory
        return msgspec.structs.replace(memory, suspensions=dict(self.suspensions))

    def _settle(self, now_s: float) -> list[Instruction]:
        """Arrange the children, also if there are none, because the parent then finishes."""
        return self._arrange(now_s)

    def time_passed(self, now_s: float) -> list[Instruction]:
        """Give up the children that exhausted the patience, then arrange; see ``Children.time_passed``."""
        return [*self._give_up(now_s), *super().time_passed(now_s)]

    @property
    def wakes_at_s(self) -> float:
        """Time at which the first suspended child exhausts the patience."""
        if self.has_finished or self.while_suspended is not WhileSuspended.FAIL:
            return math.inf
        return min(map(self._patient_until_s, self.suspensions), default=math.inf)

    def _patient_until_s(self, name: str) -> float:
        return self.suspensions[name].since_s + self.patience_s

    def _give_up(self, now_s: float) -> list[Instruction]:
        instructions: list[Instruction] = []
        for name in self._names if self.while_suspended is WhileSuspended.FAIL else ():
            if name in self.suspensions and self._patient_until_s(name) <= now_s:
                detail = f"it was suspended for {self.patience_s:g} s: {self.suspensions[name].because}"
                self.reported(name, BehaviorStatus.FAILURE, {"detail": detail})
                instructions += self.decided(name, self.decision(name), now_s)
        return instructions

    @property
    def sentence(self) -> str:
        """Which children run, and why."""
        if self.has_finished or not self._running:
            return ""
        working = [name for name in self._running if name not in self.suspensions]
        runs = f"runs {' and '.join(working)}" if working else f"waits ({self.suspended_because})"
        restarts = "".join(f"; {name} was {told}" for name in self._running if (told := self._restarts(name)))
        return runs + self._because() + restarts

    def remarks(self) -> dict[str, str]:
        """Return node → its state, also of children that are not started; see ``Children.remarks``."""
        return dict.fromkeys(self._names, "not started") | super().remarks()

    def _remark(self, name: str) -> str:
        is_failed = self.status[name] is BehaviorStatus.FAILURE
        return self.why_failed(name).partition(" ")[2] if is_failed else super()._remark(name)

    def _because(self) -> str:
        """Return the rest of the sentence: progress and reason."""
        return ""

    def _place(self, name: str) -> str:
        return f"{self._names.index(name) + 1} of {len(self._names)}"


class InSequence(Composite):
    """One child after the other: success after all have succeeded, failure at the first that fails.

    A suspended child can fail, see ``Composite``; no later child stands in for it, because their order matters.
    """

    def _because(self) -> str:
        before = self._with_status(BehaviorStatus.SUCCESS)
        after = f", after {before[-1]} succeeded" if before else ""
        return f", {self._place(self._running[0])}{after}"


class InFallback(Composite):
    """One alternative after the other: success at the first that succeeds, failure after all have failed.

    With ``WhileSuspended.NEXT``, a child without a grant for ``patience_s`` is not available: it stays started, and the
    next child that has not failed runs meanwhile. As soon as a child is at work again, the later ones are stopped; they
    start from their beginning when they are needed again. A child that failed is not tried again. If no other child
    is left, the parent waits for the suspended ones.
    """

    def decision(self, name: str) -> Decision:  # noqa: ARG002
        """Leave every finished child; the verdict tells success from failure."""
        return Decision.NEXT

    def wanted(self, now_s: float) -> list[str]:
        """Return the first available child, and the children before it, because these may become available."""
        wanted: list[str] = []
        for name in self._open:
            wanted.append(name)
            if self._unavailable_at_s(name) > now_s:
                break
        return wanted

    def verdict(self, now_s: float) -> FinishParent | None:  # noqa: ARG002
        """Return success if a child has succeeded, failure if no child is left."""
        if self._with_status(BehaviorStatus.SUCCESS):
            return FinishParent(BehaviorStatus.SUCCESS)
        if self._open:
            return None
        failed = self._with_status(BehaviorStatus.FAILURE)
        last = {"child": failed[-1], **self.payload[failed[-1]]} if failed else {}
        return FinishParent(BehaviorStatus.FAILURE, {**last, "failed": failed})

    @property
    def wakes_at_s(self) -> float:
        """Time at which the first running child becomes unavailable, or fails."""
        if self.has_finished or len(self._running) == len(self._open):
            return super().wakes_at_s
        return min([super().wakes_at_s, *map(self._unavailable_at_s, self._running[-1:])])

    def _unavailable_at_s(self, name: str) -> float:
        if self.while_suspended is not WhileSuspended.NEXT or name not in self.suspensions:
            return math.inf
        return self._patient_until_s(name)

    def _because(self) -> str:
        failed = self._with_status(BehaviorStatus.FAILURE)
        reasons = [self.why_failed(name) for name in failed[-1:]]
        if len(self._running) > 1:
            reasons += [f"{name} is suspended: {one.because}" for name, one in self.suspensions.items()]
        because = f", because {' and '.join(reasons)}" if reasons else ""
        return f", {self._place(self._running[-1])}{because}"


class Again(Composite):
    """Starts its child repeatedly; derived classes decide after which status.

    Args:
        names: Name of the child.
        most: Number of starts; -1: endless.
        pause_s: Time from an end of the child to its next start.
        while_suspended: With FAIL, a start fails whose child exhausts the patience, see ``Composite``.
        patience_s: See ``Composite``.
    """

    again_after: ClassVar[BehaviorStatus]

    def __init__(
        self,
        names: Sequence[str],
        *,
        most: int,
        pause_s: float = 0.0,
        while_suspended: WhileSuspended = WhileSuspended.WAIT,
        patience_s: float = 0.0,
    ) -> None:
        super().__init__(names, while_suspended=while_suspended, patience_s=patience_s)
        self.most, self.pause_s = most, pause_s
        self._ends, self._starts_at_s, self._why_again = 0, -math.inf, ""

    def reported(self, name: str, status: BehaviorStatus, payload: Mapping[str, object]) -> bool:
        """Record a report; count the ends, and keep the reason, because the next start has reports of its own."""
        has_finished = super().reported(name, status, payload)
        if has_finished:
            self._ends, self._why_again = self._ends + 1, self.why_failed(name)
        return has_finished

    def memory(self) -> ChildrenMemory:
        """Return the state with the decided ends; see ``Children.memory``."""
        undecided = sum(self.status[name].is_final for name in self._running)
        return msgspec.structs.replace(
            super().memory(),
            ends=self._ends - undecided,
            starts_at_s=self._starts_at_s,
            why_again=self._why_again,
        )

    def resume(self, memory: ChildrenMemory, now_s: float) -> None:
        """Continue the count and the pause; see ``Children.resume``."""
        self._ends, self._starts_at_s, self._why_again = memory.ends, memory.starts_at_s, memory.why_again
        super().resume(memory, now_s)

    def rearranged(self, names: Sequence[str], anew: Collection[str], now_s: float) -> list[Instruction]:
        """Count from the beginning for a new child; see ``Children.rearranged``."""
        if any(name not in self._names or name in anew for name in names):
            self._ends, self._starts_at_s = 0, -math.inf
        return super().rearranged(names, anew, now_s)

    def decision(self, name: str) -> Decision:
        """Return retry while starts are left."""
        if self.status[name] is self.again_after and (self.most < 0 or self._ends < self.most):
            return Decision.RETRY
        return super().decision(name)

    def decided(self, name: str, decision: Decision, now_s: float) -> list[Instruction]:
        """Begin the pause; see ``Children.decided``."""
        if decision is Decision.RETRY:
            self._starts_at_s = now_s + self.pause_s
        return super().decided(name, decision, now_s)

    def wanted(self, now_s: float) -> list[str]:
        """Return the child, but none during the pause."""
        return self._open if now_s >= self._starts_at_s else []

    @property
    def wakes_at_s(self) -> float:
        """Time at which the pause is over, or the child exhausts the patience."""
        return super().wakes_at_s if self.has_finished or self._running else self._starts_at_s

    @property
    def sentence(self) -> str:
        """Whether the child runs, or when it starts again."""
        if self.has_finished or self._running:
            return super().sentence
        return f"starts {self._open[0]} again at {self._starts_at_s:.1f} s of mission time{self._because()}"

    def _because(self) -> str:
        turn = f", {self._turn} {self._ends + 1}" + ("" if self.most < 0 else f" of {self.most}")
        failed = self._ends and self.again_after is BehaviorStatus.FAILURE
        return turn + (f", because {self._why_again}" if failed else "")

    @property
    def _turn(self) -> str:
        return "attempt" if self.again_after is BehaviorStatus.FAILURE else "cycle"


class WithRetries(Again):
    """Starts its child again while it fails: success as soon as the child succeeds, failure after ``most`` attempts."""

    again_after = BehaviorStatus.FAILURE


class WithRepeats(Again):
    """Starts its child again while it succeeds: success after ``most`` cycles, failure as soon as the child fails."""

    again_after = BehaviorStatus.SUCCESS
