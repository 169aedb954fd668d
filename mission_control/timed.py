"""The rules of nodes that count time. Pure; see ``composites``."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import msgspec

from mission_control.children import ChildrenMemory, FinishParent, Instruction
from mission_control.composites import Composite, WhileSuspended
from mission_control.messages import BehaviorStatus


class Stopwatch:
    """A timer that can be stopped and started, with a limit."""

    def __init__(self) -> None:
        self.sum_s = 0.0
        """The sum at the last change."""
        self.since_s = math.inf
        """Time since which it runs; infinite: it is stopped."""

    def run(self, now_s: float, *, running: bool) -> None:
        """Start or stop the timer."""
        self.sum_s += max(0.0, now_s - self.since_s)
        self.since_s = now_s if running else math.inf

    def reaches_at_s(self, limit_s: float) -> float:
        """Return the time at which the sum reaches the limit; infinite while the timer is stopped."""
        return -math.inf if self.sum_s >= limit_s else self.since_s + (limit_s - self.sum_s)


class Timed(Composite):
    """A node with a stopwatch that begins with the node."""

    def __init__(
        self, names: Sequence[str], *, seconds: float, while_suspended: WhileSuspended = WhileSuspended.WAIT
    ) -> None:
        super().__init__(names, while_suspended=while_suspended)
        self.seconds, self._watch = seconds, Stopwatch()

    def begin(self, now_s: float) -> list[Instruction]:
        """Start the stopwatch, and the child if there is one."""
        self._watch.run(now_s, running=True)
        return super().begin(now_s)

    def memory(self) -> ChildrenMemory:
        """Return the state with the stopwatch; see ``Children.memory``."""
        return msgspec.structs.replace(super().memory(), sum_s=self._watch.sum_s, since_s=self._watch.since_s)

    def resume(self, memory: ChildrenMemory, now_s: float) -> None:
        """Continue the stopwatch, which ran on if it ran before; see ``Children.resume``."""
        self._watch.sum_s, self._watch.since_s = memory.sum_s, memory.since_s
        super().resume(memory, now_s)

    @property
    def wakes_at_s(self) -> float:
        """When the time is over."""
        return math.inf if self.has_finished else self._watch.reaches_at_s(self.seconds)


class WithTimeout(Timed):
    """Runs its child for at most ``seconds``: the result is the child's, or failure when the time is over.

    While the child is suspended, the timer stops with ``WhileSuspended.WAIT`` and runs with ``COUNT``.
    """

    def suspended(self, name: str, because: str, now_s: float) -> list[Instruction]:
        """Stop or start the timer; see ``Children.suspended``."""
        instructions = super().suspended(name, because, now_s)
        self._run_or_stop(now_s)
        return instructions

    def rearranged(self, names: Sequence[str], anew: Collection[str], now_s: float) -> list[Instruction]:
        """Start the timer again if the suspended child was removed; see ``Children.rearranged``."""
        instructions = super().rearranged(names, anew, now_s)
        self._run_or_stop(now_s)
        return instructions

    def time_passed(self, now_s: float) -> list[Instruction]:
        """Stop or start the timer if ``while_suspended`` was changed; see ``Children.time_passed``."""
        self._run_or_stop(now_s)
        return super().time_passed(now_s)

    def _run_or_stop(self, now_s: float) -> None:
        is_counted = not self.suspensions or self.while_suspended is WhileSuspended.COUNT
        self._watch.run(now_s, running=self._has_begun and is_counted)

    def verdict(self, now_s: float) -> FinishParent | None:
        """Return failure when the time is over."""
        is_at_work = any(not self.status[name].is_final for name in self._running)
        if is_at_work and now_s >= self._watch.reaches_at_s(self.seconds):
            detail = f"{self._open[0]} was not done within {self.seconds:g} s"
            return FinishParent(BehaviorStatus.FAILURE, {"child": self._open[0], "detail": detail})
        return super().verdict(now_s)

    def _because(self) -> str:
        until_s = self.wakes_at_s
        if until_s < math.inf:
            return f", until {until_s:.1f} s of mission time"
        return f", {self.seconds - self._watch.sum_s:.1f} s left"


class WithDelay(Timed):
    """A node without children: success after ``seconds``."""

    def time_passed(self, now_s: float) -> list[Instruction]:
        """Finish when the time is over."""
        return self._arrange(now_s)

    def verdict(self, now_s: float) -> FinishParent | None:
        """Return success when the time is over."""
        return FinishParent(BehaviorStatus.SUCCESS) if now_s >= self.wakes_at_s else None

    @property
    def sentence(self) -> str:
        """Text about the end of the wait."""
        return "" if self.has_finished else f"waits until {self.wakes_at_s:.1f} s of mission time"
