"""ChildrenLoop: carries out the instructions of the rules for a behavior's children.

Rule of this file: an order waits for earlier orders of the same answer and for earlier orders about the same child; the
end of the parent waits for all orders. So no child is started before it has stopped. If a stop takes long because a
host does not answer, other answers of the rules are not delayed.
"""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import assert_never

import msgspec

from backbone.component.messages import Absence
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.child_keeper import ChildKeeper
from mission_control.children import (
    Children,
    ChildrenMemory,
    Decision,
    FinishParent,
    Instruction,
    StartChild,
    StopChild,
)
from mission_control.messages import BehaviorStatus


@dataclass(frozen=True, slots=True)
class ChildOrder:
    """An instruction, and the earlier orders about the same child."""

    instruction: Instruction
    after: Sequence[asyncio.Event]
    is_done: asyncio.Event = field(default_factory=asyncio.Event)


class ChildrenLoop:
    """Passes the events of children and the time to the rules, and carries out the answers."""

    def __init__(self, parent: BehaviorOfParts, rules: Children) -> None:
        self.rules = rules
        """The state of the children."""
        self._parent, self._clock, self._nodes = parent, parent.clock, parent.child_nodes
        self._keeper = ChildKeeper(parent, self.reported, self._child_fell, self._child_left)
        self.given_up: dict[str, Absence] = {}
        """Name of a behavior that could not work → the absence that is reported."""
        self._last_orders: dict[str, asyncio.Event] = {}
        self._has_begun = False
        self._stopping = list[str]()  # as often as stops of a child are not confirmed
        self._left_off: Sequence[str] = ()  # children whose stop an earlier process may not have carried out
        self.begun_anew, self._stopped = 0, Counter[str]()
        """Number of times that the parent began anew under the same order."""
        self._waking: asyncio.Task[None] | None = None
        self._wakes_at_s, self._woke_at_s = math.inf, -math.inf
        self._latest_s = -math.inf

    def begin(self) -> None:
        """Start the children that run first; end children of an earlier process that are not wanted."""
        self._has_begun = True
        left_off = [StopChild(name) for name in self._left_off]
        self._carry_out([*left_off, *self.rules.begin(self._now_s())])
        if self._nodes:
            self._parent.begin_task(
                self._keeper.stop_those_of_an_earlier_life(self.rules.is_running), "children of an earlier life"
            )

    def memory(self) -> ChildrenMemory:
        """Return the state from which ``resume`` continues."""
        return msgspec.structs.replace(
            self.rules.memory(), stopping=list(self._stopping), begun_anew=self.begun_anew, stopped=dict(self._stopped)
        )

    def resume(self, memory: ChildrenMemory) -> None:
        """Continue from the state of an earlier process; call it before ``begin``."""
        self._left_off, self._stopped = tuple(memory.stopping), Counter(memory.stopped)
        self.begun_anew = memory.begun_anew
        self.rules.resume(memory, self._now_s())

    def reported(
        self, name: str, status: BehaviorStatus, payload: Mapping[str, object], suspended_because: str = ""
    ) -> None:
        """Handle a child's report; a final status leads to a decision."""
        if self.rules.reported(name, status, payload):
            self._parent.story.note(name, f"finished: {status}")
            self._parent.begin_task(self._decide(name, status, payload), f"decide on {name}")
        elif not status.is_final:
            self._carry_out(self.rules.suspended(name, suspended_because, self._now_s()))

    def look_again(self) -> None:
        """Apply the rules now, after a change of their settings."""
        self._carry_out(self.rules.time_passed(self._now_s()))

    async def rearranged(self, gone: Collection[str], anew: Collection[str]) -> None:
        """Apply the rules to the present nodes; return when no removed child runs any more.

        Args:
            gone: Names of the removed nodes.
            anew: Names of nodes that end and begin again.
        """
        for name in (*gone, *anew):
            if self.given_up.pop(name, None) is not None:
                self._parent.changed()
        self._carry_out(self.rules.rearranged(list(self._nodes), anew, self._now_s()))
        for name in gone:
            if name in self._last_orders:
                await self._last_orders[name].wait()

    async def end(self) -> None:
        """End all started children, also those of an earlier process, and wait for that; start no other child."""
        stops = [each.name for each in self.rules.end() if isinstance(each, StopChild)]
        self._arm()
        await asyncio.gather(*map(self._keeper.stop, stops))
        if not self._has_begun and self._nodes:
            await self._keeper.stop_those_of_an_earlier_life(self.rules.is_running)

    def absences(self, *, has_finished: bool) -> list[Absence]:
        """Return the children that are given up and, until the behavior has finished, those that are missing."""
        return [*([] if has_finished else self._keeper.absences()), *self.given_up.values()]

    def give_up(self, name: str, payload: Mapping[str, object]) -> None:
        """Report a behavior that could not work as a lasting absence; a behavior that ran and failed is not absent."""
        if "code" in payload:
            remedy = (
                f"see 'scout-backbone story {name}', mend the cause, then stop {self._parent.name} and start it again"
            )
            cause = str(payload.get("detail", "it failed"))
            self.given_up[name] = Absence(name, self._clock.now_s(), cause, remedy=remedy)
            self._parent.changed()

    def _order_id(self, name: str) -> str:
        """Return the id of the present order of this child, which is another one after each of its ends."""
        own = self._parent.launch.order_id
        return own and f"{own}.{self.begun_anew}.{self._stopped[name]}"

    def _child_fell(self, name: str, how: str) -> None:
        self.rules.fell(name, how)
        self._parent.rules_applied()

    def _child_left(self, name: str) -> None:
        self._stopped[name] += 1
        self._carry_out(self.rules.left(name, self._now_s()))

    async def _decide(self, name: str, status: BehaviorStatus, payload: Mapping[str, object]) -> None:
        decision = await self._parent.child_finished(name, status, payload)
        self._parent.story.note(name, f"{decision} after {status}")
        if decision is not Decision.RETRY and not self.rules.expects_failures:
            self.give_up(name, payload)
        self._carry_out(self.rules.decided(name, decision, self._now_s()))

    def _carry_out(self, instructions: Sequence[Instruction]) -> None:
        if instructions:
            self._parent.begin_task(self._obey_in_order([self._order(each) for each in instructions]), "children")
        self._arm()
        self._parent.rules_applied()

    def _order(self, instruction: Instruction) -> ChildOrder:
        if isinstance(instruction, FinishParent):
            return ChildOrder(instruction, list(self._last_orders.values()))
        if isinstance(instruction, StopChild):
            self._stopping.append(instruction.name)
        before = self._last_orders.get(instruction.name)
        order = ChildOrder(instruction, [] if before is None else [before])
        self._last_orders[instruction.name] = order.is_done
        return order

    async def _obey_in_order(self, orders: Sequence[ChildOrder]) -> None:
        for order in orders:
            for earlier in order.after:
                await earlier.wait()
            await self._obey(order.instruction)
            order.is_done.set()

    async def _obey(self, instruction: Instruction) -> None:
        match instruction:
            case StartChild(name):
                self.given_up.pop(name, None)
                if not self.rules.has_finished:
                    await self._keeper.start(name, self._order_id(name))
            case StopChild(name):
                await self._keeper.stop(name)
                self._stopping.remove(name)
                self._stopped[name] += 1
                self._parent.keep_memory()
            case FinishParent(status, payload):
                await self._parent.children_finished(status, payload)
            case _:
                assert_never(instruction)

    def _arm(self) -> None:
        """Set a timer for the time that the rules name; one timer for each such time."""
        at_s = self.rules.wakes_at_s
        if at_s in (self._wakes_at_s, self._woke_at_s):
            return
        waking, self._waking, self._wakes_at_s = self._waking, None, at_s
        if waking is not None:
            waking.cancel()
        if at_s < math.inf:
            self._waking = self._parent.begin_task(self._wake(at_s), "wake")

    async def _wake(self, at_s: float) -> None:
        await self._clock.sleep_until_s(at_s)
        self._waking, self._wakes_at_s, self._woke_at_s = None, math.inf, at_s
        self._carry_out(self.rules.time_passed(self._now_s(at_s)))

    def _now_s(self, at_least_s: float = -math.inf) -> float:
        """Return a time that never runs backwards, because a sleep may end early by a rounding error."""
        self._latest_s = max(self._latest_s, at_least_s, self._clock.now_s())
        return self._latest_s
