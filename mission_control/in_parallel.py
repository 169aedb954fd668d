"""The rules of a parent whose children run at the same time. Pure; see ``composites``."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from mission_control.children import ChildrenMemory, Decision, FinishParent, Instruction
from mission_control.composites import ENDLESS, Composite, WhileSuspended
from mission_control.messages import BehaviorStatus


class InParallel(Composite):
    """All children at the same time: the numbers of successes and of failures decide.

    Args:
        success_count: Number of successes for a success; -1: all, -2: all but one, and so on, but at least one.
        failure_count: Number of failures for a failure; negative as above. The parent also fails as soon as too few
            children are left for a success.
        while_suspended: With FAIL, see ``Composite``. With SKIP, a child that exhausts the patience stays started, but
            is not counted until it is at work again; if no other child is left, the parent waits.
        patience_s: See ``Composite``.
    """

    def __init__(
        self,
        names: Sequence[str],
        *,
        success_count: int = ENDLESS,
        failure_count: int = 1,
        while_suspended: WhileSuspended = WhileSuspended.WAIT,
        patience_s: float = 0.0,
    ) -> None:
        super().__init__(names, while_suspended=while_suspended, patience_s=patience_s, together=True)
        self.success_count, self.failure_count = success_count, failure_count
        self._skipped = dict[str, float]()  # child → begin of the suspension for which it is skipped

    def decision(self, name: str) -> Decision:  # noqa: ARG002
        """Leave every finished child; the verdict counts the results."""
        return Decision.NEXT

    def verdict(self, now_s: float) -> FinishParent | None:  # noqa: ARG002
        """Return the result as soon as the counts determine it."""
        succeeded, failed = self._with_status(BehaviorStatus.SUCCESS), self._with_status(BehaviorStatus.FAILURE)
        in_all = len(succeeded) + len(failed) + len(self._undecided)
        if in_all == 0 and self._left_out:
            return None
        needed = self._threshold(self.success_count, in_all)
        if len(succeeded) >= needed:
            return FinishParent(BehaviorStatus.SUCCESS)
        if in_all - len(failed) < needed or len(failed) >= self._threshold(self.failure_count, in_all):
            reasons = "; ".join(map(self.why_failed, failed))
            detail = f"{len(succeeded)} of {in_all} succeeded, {needed} needed" + (f": {reasons}" if reasons else "")
            return FinishParent(BehaviorStatus.FAILURE, {"failed": failed, "detail": detail})
        return None

    def memory(self) -> ChildrenMemory:
        """Return the state with the skipped children; see ``Children.memory``."""
        return msgspec.structs.replace(super().memory(), skipped=dict(self._skipped))

    def resume(self, memory: ChildrenMemory, now_s: float) -> None:
        """Skip the same children; see ``Children.resume``."""
        self._skipped = dict(memory.skipped)
        super().resume(memory, now_s)

    def time_passed(self, now_s: float) -> list[Instruction]:
        """Skip the children that exhausted the patience; see ``Composite.time_passed``."""
        if self.while_suspended is WhileSuspended.SKIP:
            late = [name for name in self.suspensions if self._patient_until_s(name) <= now_s]
            self._skipped |= {name: self.suspensions[name].since_s for name in late}
        return super().time_passed(now_s)

    @property
    def wakes_at_s(self) -> float:
        """Time at which the first suspended child exhausts the patience."""
        if self.has_finished or self.while_suspended is not WhileSuspended.SKIP:
            return super().wakes_at_s
        counted = (name for name in self.suspensions if name not in self._left_out)
        return min(map(self._patient_until_s, counted), default=math.inf)

    @property
    def _left_out(self) -> list[str]:
        """The children that are skipped now."""
        if self.while_suspended is not WhileSuspended.SKIP:
            return []
        return [name for name, one in self.suspensions.items() if self._skipped.get(name) == one.since_s]

    @property
    def _undecided(self) -> list[str]:
        finished = [name for name, status in self.status.items() if status.is_final]
        return [name for name in self._open if name not in finished and name not in self._left_out]

    @staticmethod
    def _threshold(count: int, in_all: int) -> int:
        return count if count >= 0 else max(in_all + count + 1, min(in_all, 1))

    def _because(self) -> str:
        succeeded, failed = self._with_status(BehaviorStatus.SUCCESS), self._with_status(BehaviorStatus.FAILURE)
        needed = self._threshold(self.success_count, len(succeeded) + len(failed) + len(self._undecided))
        because = f", because {self.why_failed(failed[-1])}" if failed else ""
        without = f", without {' and '.join(self._left_out)}, suspended for too long" if self._left_out else ""
        return f", {len(succeeded)} of {needed} needed successes{without}{because}"
