"""Random trees of composites, run by events through the rules; ``ticked_trees`` runs them by ticks.

Time is counted in ticks. A leaf works for some ticks in which it is not suspended, then succeeds or fails; its results
differ from start to start. At one instant, children come before their parent's own clock, in the order of the file.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec
from hypothesis import strategies as st

from mission_control.children import (
    Children,
    ChildrenMemory,
    Decision,
    FinishParent,
    Instruction,
    StartChild,
    StopChild,
)
from mission_control.composites import InFallback, InSequence, WhileSuspended, WithRepeats, WithRetries
from mission_control.in_parallel import InParallel
from mission_control.messages import BehaviorStatus
from mission_control.timed import WithDelay, WithTimeout

LONGEST = 120  # ticks of one run
RUNNING, SUCCESS, FAILURE = BehaviorStatus.RUNNING, BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE


@dataclass(frozen=True)
class Plan:
    """A node: ``leaf`` has ``outcomes`` (ticks of work, success) and the ticks in which it is suspended."""

    kind: str
    name: str
    children: tuple[Plan, ...] = ()
    outcomes: tuple[tuple[int, bool], ...] = ()
    suspended: frozenset[int] = frozenset()
    settings: dict[str, Any] = field(default_factory=dict)


RULES: dict[str, type[Children]] = {
    "sequence": InSequence,
    "fallback": InFallback,
    "parallel": InParallel,
    "retry": WithRetries,
    "repeat": WithRepeats,
    "timeout": WithTimeout,
    "wait": WithDelay,
}
Result = tuple[BehaviorStatus, int] | None
"""Final status and its tick; None: still running after the longest time."""


@st.composite
def _suspensions(draw: st.DrawFn) -> frozenset[int]:
    spans = draw(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 15)), max_size=3))
    return frozenset(tick for begin, length in spans for tick in range(begin, begin + length))


@st.composite
def trees(draw: st.DrawFn, depth: int = 4, name: str = "n") -> Plan:
    """Draw a tree whose nodes are named by their place."""
    inner = ["sequence", "fallback", "parallel", "retry", "repeat", "timeout"] if depth > 1 else []
    kind = draw(st.sampled_from([*inner, *inner, "leaf", "wait"] if inner else ["leaf", "leaf", "leaf", "wait"]))
    count = draw(st.integers(1, 3)) if kind in ("sequence", "fallback", "parallel") else int(kind in inner)
    children = tuple(draw(trees(depth - 1, f"{name}{number}")) for number in range(count))
    impatient = {"while_suspended": WhileSuspended.FAIL, "patience_s": draw(st.integers(1, 8))} if inner else {}
    patience = st.sampled_from([{}, impatient])
    match kind:
        case "leaf":
            outcomes = draw(st.lists(st.tuples(st.integers(1, 12), st.booleans()), min_size=1, max_size=3))
            return Plan(kind, name, outcomes=tuple(outcomes), suspended=draw(_suspensions()))
        case "parallel":
            thresholds = st.integers(1, count) | st.integers(-count, -1)
            settings = {"success_count": draw(thresholds), "failure_count": draw(thresholds)}
            settings |= draw(patience | st.just({**impatient, "while_suspended": WhileSuspended.SKIP}))
        case "retry" | "repeat":
            settings = {"most": draw(st.sampled_from([-1, 1, 2, 3])), "pause_s": draw(st.integers(0, 3))}
            settings |= draw(patience)
        case "timeout":
            how = draw(st.sampled_from([WhileSuspended.WAIT, WhileSuspended.COUNT]))
            settings = {"seconds": draw(st.integers(1, 30)), "while_suspended": how}
        case "wait":
            settings = {"seconds": draw(st.integers(1, 12))}
        case "fallback":
            how = draw(st.sampled_from([WhileSuspended.WAIT, WhileSuspended.NEXT]))
            settings = {"while_suspended": how, "patience_s": draw(st.integers(0, 5))}
            settings = draw(st.just(settings) | st.just(impatient))
        case _:
            settings = draw(patience)
    return Plan(kind, name, children, settings=settings)


@st.composite
def impatient_trees(draw: st.DrawFn, kind: str, how: WhileSuspended = WhileSuspended.FAIL) -> Plan:
    """Draw a parent of this kind that has little patience, with children that are suspended for long, and again."""
    names = [f"n{number}" for number in range(draw(st.integers(2, 3)) if kind in ("parallel", "fallback") else 1)]
    settings = {"patience_s": draw(st.integers(1, 5)), "while_suspended": how}
    match kind:
        case "retry" | "repeat":
            settings |= {"most": draw(st.sampled_from([-1, 2, 3])), "pause_s": draw(st.integers(0, 3))}
        case "parallel":
            thresholds = st.integers(1, len(names)) | st.integers(-len(names), -1)
            settings |= {"success_count": draw(thresholds), "failure_count": draw(thresholds)}
    leaves = []
    for name in names:
        outcomes = draw(st.lists(st.tuples(st.integers(1, 20), st.booleans()), min_size=1, max_size=2))
        gaps = draw(st.lists(st.tuples(st.integers(1, 6), st.integers(1, 12)), min_size=1, max_size=3))
        suspended, tick = set[int](), 0
        for at_work, stands in gaps:
            tick += at_work
            suspended |= {*range(tick, tick + stands)}
            tick += stands
        leaves.append(Plan("leaf", name, outcomes=tuple(outcomes), suspended=frozenset(suspended)))
    return Plan(kind, "n", tuple(leaves), settings=settings)


class ByEvents:
    """Runs a tree through the rules, and checks on the way that nothing starts twice or after the end."""

    def __init__(
        self,
        plan: Plan,
        changes: Mapping[int, tuple[Plan, ...]] | None = None,
        kills: Mapping[int, frozenset[str]] | None = None,
    ) -> None:
        """Create a run.

        Args:
            changes: At the begin of a tick → the children of the root from then on.
            kills: At the end of a tick → the nodes whose process ends; the next one continues from their memory.
        """
        self.now = 0
        self.runs = Counter[str]()
        self.began: dict[str, int] = {}
        self.result: Result = None
        self.kids: dict[str, _Node] = {}
        self._changes, self._kills = changes or {}, kills or {}
        self._root = self.make(plan)

    def run(self) -> Result:
        self.kids[self._root.plan.name] = self._root
        self._root.begin()
        while self.result is None and self.now < LONGEST:
            self.now += 1
            if self.now in self._changes and isinstance(self._root, _Inner):
                self._root.rearrange(self._changes[self.now])
            if self.result is None:
                self._root.visit()
            if self.result is None:
                self._root.kill(self._kills.get(self.now, frozenset()))
        return self.result

    def make(self, plan: Plan, parent: _Inner | None = None) -> _Node:
        self.runs[plan.name] += 1
        self.began.setdefault(plan.name, self.now)
        return (_Leaf if plan.kind == "leaf" else _Inner)(self, plan, parent)


class _Node:
    def __init__(self, world: ByEvents, plan: Plan, parent: _Inner | None) -> None:
        self.world, self.plan, self.parent = world, plan, parent
        self.began_at, self.is_over, self.reported_suspended = world.now, False, False

    def begin(self) -> None: ...
    def visit(self) -> None: ...
    def stop(self) -> None: ...
    def kill(self, names: frozenset[str]) -> None: ...

    def report(self, status: BehaviorStatus) -> None:
        assert not self.is_over, f"{self.plan.name} finished twice"
        self.is_over = True
        if self.parent is None:
            self.world.result = (status, self.world.now)
        else:
            self.parent.heard(self.plan.name, status)

    def report_suspended(self, is_suspended: bool) -> None:
        if is_suspended != self.reported_suspended and not self.is_over:
            self.reported_suspended = is_suspended
            if self.parent is not None:
                self.parent.heard_suspended(self.plan.name, is_suspended)


class _Leaf(_Node):
    def begin(self) -> None:
        outcomes = self.plan.outcomes
        self.left, self.succeeds = outcomes[(self.world.runs[self.plan.name] - 1) % len(outcomes)]
        self.report_suspended(self.world.now in self.plan.suspended)

    def visit(self) -> None:
        self.left -= not self.reported_suspended
        if self.left == 0:
            self.report(SUCCESS if self.succeeds else FAILURE)
        else:
            self.report_suspended(self.world.now in self.plan.suspended)

    def stop(self) -> None:
        self.is_over = True


class _Inner(_Node):
    def __init__(self, world: ByEvents, plan: Plan, parent: _Inner | None) -> None:
        super().__init__(world, plan, parent)
        self.rules: Any = RULES[plan.kind]([child.name for child in plan.children], **plan.settings)
        self.plans = {child.name: child for child in plan.children}
        self.kids: dict[str, _Node] = {}
        self.orders: deque[Instruction] = deque()
        self.adopts = set[str]()
        self.is_working = False

    def begin(self) -> None:
        self.carry_out(self.rules.begin(self.world.now))
        self.settle()

    def visit(self) -> None:
        for name in self.plans:
            if name in self.kids and self.kids[name].began_at < self.world.now:
                self.kids[name].visit()
        if not self.is_over and self.rules.wakes_at_s <= self.world.now:
            self.carry_out(self.rules.time_passed(self.world.now))
            assert self.is_over or self.rules.wakes_at_s > self.world.now, "it would wake for ever"
        self.settle()

    def rearrange(self, children: tuple[Plan, ...]) -> None:
        anew = {one.name for one in children if self.plans.get(one.name, one) is not one}
        self.plans = {child.name: child for child in children}
        self.carry_out(self.rules.rearranged(list(self.plans), anew, self.world.now))
        self.settle()

    def kill(self, names: frozenset[str]) -> None:
        for kid in self.kids.values():
            kid.kill(names)
        if self.plan.name in names:
            memory = msgspec.msgpack.decode(msgspec.msgpack.encode(self.rules.memory()), type=ChildrenMemory)
            self.rules = RULES[self.plan.kind](list(self.plans), **self.plan.settings)
            self.rules.resume(memory, self.world.now)
            self.adopts = set(self.kids)
            self.carry_out(self.rules.begin(self.world.now))
            assert not self.adopts, f"{self.plan.name} left {self.adopts} alone"
            self.settle()

    def settle(self) -> None:
        self.report_suspended(bool(self.rules.suspended_because))

    def stop(self) -> None:
        self.carry_out(self.rules.end())
        assert not self.kids, f"{self.plan.name} left {list(self.kids)} running"
        self.is_over = True

    def heard(self, name: str, status: BehaviorStatus) -> None:
        assert self.rules.reported(name, status, {})
        self.carry_out(self.rules.decided(name, self.rules.decision(name), self.world.now))

    def heard_suspended(self, name: str, is_suspended: bool) -> None:
        self.carry_out(self.rules.suspended(name, "slice" if is_suspended else "", self.world.now))

    def carry_out(self, instructions: Sequence[Instruction]) -> None:
        self.orders.extend(instructions)
        if self.is_working:
            return
        self.is_working = True
        while self.orders:
            self.obey(self.orders.popleft())
        self.is_working = False

    def obey(self, instruction: Instruction) -> None:
        match instruction:
            case StartChild(name) if name in self.adopts:
                self.adopts.remove(name)
                self.heard_suspended(name, self.kids[name].reported_suspended)
            case StartChild(name):
                assert not self.is_over, f"{self.plan.name} starts {name} after its end"
                assert name not in self.kids, f"{self.plan.name} starts {name} twice"
                self.kids[name] = self.world.make(self.plans[name], self)
                self.kids[name].begin()
            case StopChild(name):
                self.kids.pop(name).stop()
            case FinishParent(status):
                assert not self.kids, f"{self.plan.name} finishes before {list(self.kids)} have ended"
                self.report(status)


def decide(rules: Children, name: str, now: float) -> list[Instruction]:
    """Return what the rules answer to a finished child."""
    decision: Decision = rules.decision(name)
    return rules.decided(name, decision, now)
