"""Behavior: base class of every decision process except consoles.

A behavior claims at most one ARC, is notified of the begin and end of grants, starts its children through the placer
and reports its progress to its parent. Begin with a copy of ``behaviors/skeleton.py``.

State on ``self`` survives every suspension, because only the RCs are taken and the process continues.

Source: SMC 2000 and RAM 2002, "Mission Control".
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Mapping, Sequence
from typing import Any, ClassVar, Generic, Self, TypeVar

import msgspec

from backbone.addresses import LAUNCHER
from backbone.bus.interface import Bus, Clock
from backbone.component.class_path import load_class
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import Absence, LifeState, LogLevel
from backbone.debug_views import ListViews, LookAt
from backbone.exchange import SwapClass
from backbone.launcher.messages import BranchTaken, TakeBranch
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode, PathStep
from backbone.mission.behavior_orders import TREE_PARAMETERS
from backbone.naming import component_of
from backbone.reading_anew import WrongClass
from backbone.wire import Accepts, Envelope, Message, UnknownMessage
from mission_control.behavior_exchange import BehaviorExchanges
from mission_control.behavior_hooks import BehaviorHooks
from mission_control.behavior_memory import BehaviorMemory
from mission_control.behavior_tree import state_of
from mission_control.child_keeper import end_by_placer
from mission_control.children import Children, Decision
from mission_control.children_loop import ChildrenLoop
from mission_control.debug_views import DebugViews
from mission_control.gated_bus import GatedBus, without_exit
from mission_control.keeper_reports import KeeperReports
from mission_control.messages import (
    AskBehavior,
    BehaviorStatus,
    BreakOff,
    BrokenOff,
    ChildReport,
    NotAChild,
    NotYourOrder,
    ReportNoted,
)
from mission_control.own_arc import NO_GRANT_YET, OwnArc
from mission_control.own_reports import OwnReports
from resource_pool.arc_client import ArcClient, ArcNotice

log = logging.getLogger(__name__)

DRAIN_TIME_S = 1.2  # chosen: shorter than the 1.5 s its creator gives it before SIGTERM


class BehaviorParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Parameters from the tree for every behavior; derive and add the behavior's own parameters, with defaults.

    Attributes:
        path: Names and priorities from the mission's root to this node; empty: the behavior was started manually.
        arc: The ARC that the behavior claims, if any.
        children: Nodes that the behavior starts.
        is_last: True: the behavior is the root of the last branch, which runs at the end of the mission.
        keeper: Address of the console that ordered the behavior; empty: the behavior is a node of the mission's tree.
    """

    path: list[PathStep] = []
    arc: ArcNeed | None = None
    children: list[BehaviorNode] = []
    is_last: bool = False
    keeper: str = ""


def load_behavior(class_path: str) -> type[Behavior[BehaviorParameters]]:
    """Return the behavior class at ``package.module:Class``.

    Raises:
        WrongClassPath: No component class has this path.
        WrongClass: The class is not a behavior.
    """
    found = load_class(class_path)
    if not issubclass(found, Behavior):
        raise WrongClass(f"{class_path} is no behavior", remedy="Derive it from mission_control.behavior:Behavior.")
    return found


B = TypeVar("B", bound=BehaviorParameters)


class Behavior(Component[B], BehaviorHooks, Generic[B]):
    """A running node of the behavior tree.

    Derive and override the hooks of ``BehaviorHooks`` that you need. Class variables to set: ``parameters_type``,
    ``children_together`` (False: one after the other), ``children_allowed`` (fewest, most), ``may_claim`` (an ARC).
    """

    parameters_type: ClassVar[type[msgspec.Struct]] = BehaviorParameters
    given_elsewhere: ClassVar[frozenset[str]] = frozenset(TREE_PARAMETERS)
    fixed: ClassVar[frozenset[str]] = given_elsewhere
    accepts: ClassVar[Accepts | None] = (
        ArcNotice | ChildReport | AskBehavior | TakeBranch | BreakOff | ListViews | LookAt | SwapClass
    )
    children_together: ClassVar[bool] = True
    children_allowed: ClassVar[tuple[int, int] | None] = None
    may_claim: ClassVar[bool] = True
    hands_over: ClassVar[frozenset[str]] = frozenset()
    """Attributes that a replacing class takes over if it declares them, too; see ``behavior_exchange``."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        self.gate = bus if isinstance(bus, GatedBus) else GatedBus(bus)
        """Its bus; the gate is shut while another class is in charge."""
        self.exchanges = BehaviorExchanges(self, load_behavior)
        """The implementations of the component, and their exchanges."""
        super().__init__(launch, self.gate, clock)
        self.status, self.payload = BehaviorStatus.RUNNING, dict[str, object]()
        self.own_arc = OwnArc(self, self)
        """The claim of its ARC, and the grants."""
        self.views = DebugViews(self.gate, clock)
        """Its debug views: pictures and values that cost nothing unless a console looks."""
        self.child_nodes = {node.name: node for node in self.parameters.children}
        """Name of a child → its node of the tree."""
        self._children = ChildrenLoop(self, self.rules(list(self.child_nodes)))
        self._memory = BehaviorMemory(self, self, self._children, launch)
        self.has_begun = False
        self.tree_version, self._left = 0, set[str]()
        self.own_reports = OwnReports(self)
        """Its reports to its parent, or to the console that ordered it."""

    def need(self) -> ArcNeed | None:
        """Return the ARC of the tree; see ``BehaviorHooks``."""
        return self.parameters.arc

    def rules(self, children: Sequence[str]) -> Children:
        """Return the rules by which children are started and judged; see ``BehaviorHooks``."""
        return Children(children, together=self.children_together)

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, object]) -> Decision:  # noqa: ARG002
        """Return the decision of the rules; see ``BehaviorHooks``."""
        return self._children.rules.decision(child)

    async def children_finished(self, status: BehaviorStatus, payload: Mapping[str, object]) -> None:
        """Finish with the same status; see ``BehaviorHooks``."""
        self.finish(status, payload)

    @property
    def path(self) -> Sequence[PathStep]:
        """Names and priorities from the mission's root to this node."""
        return self.parameters.path or [(self.name, 0)]

    @property
    def arc(self) -> ArcClient | None:
        """The client of its ARC; None without an ARC."""
        return self.own_arc.client

    @property
    def rcs(self) -> Mapping[str, str]:
        """Role → name of the granted RCs; empty while suspended."""
        return self.own_arc.rcs

    @property
    def robot(self) -> str:
        """The granted RC that has a body; empty while suspended, and without one."""
        return self.own_arc.robot

    @property
    def children(self) -> Mapping[str, BehaviorStatus]:
        """Status of each child that was started."""
        return self._children.rules.status

    @property
    def suspended_because(self) -> str:
        """Why the behavior is not at work; see ``BehaviorState``."""
        if self.status.is_final:
            return ""
        if self.parameters.keeper and not self.has_begun:
            return NO_GRANT_YET
        return self.own_arc.suspended_because if self.arc is not None else self._children.rules.suspended_because

    def finish(self, status: BehaviorStatus, payload: Mapping[str, object] | None = None) -> None:
        """Finish: release the ARC, end the children, report to the parent. Later calls change nothing.

        Raises:
            TypeError: The status is no ``BehaviorStatus``.
        """
        if not isinstance(status, BehaviorStatus):
            raise TypeError(f"finish({status!r}): write BehaviorStatus.SUCCESS or BehaviorStatus.FAILURE")
        if self.status.is_final or not status.is_final or not self.exchanges.may_finish(self, status, payload or {}):
            return
        self.status, self.payload, failed = status, dict(payload or {}), status is BehaviorStatus.FAILURE
        self.keep_memory()
        self.publish_event(self.name, f"finished: {status}", LogLevel.WARNING if failed else LogLevel.NOTICE)
        self.report(f"finished: {status}" + (f"; last: {self.feedback}" if self.feedback else ""))
        self.begin_task(self._wind_up(), "wind-up")

    def tell_parent(self, payload: Mapping[str, object]) -> None:
        """Send a report of progress to the parent, and keep the memory; only the newest report is sent for certain."""
        if not self.status.is_final:
            self.payload = dict(payload)
            self.own_reports.send()
            self.keep_memory()

    def keep_memory(self) -> None:
        """Keep ``memory`` and the state of the children for the behavior's next process, if this one is killed."""
        self._memory.keep()

    @property
    def is_ordered(self) -> bool:
        """True: a console ordered this behavior."""
        return bool(self.parameters.keeper)

    async def run(self) -> None:
        """Run this class and every class that replaces it; see ``Component.run``."""
        life = super().run()
        await (self.exchanges.run(life) if self.gate.is_first else life)

    async def leave_bus(self) -> None:
        """Withdraw all declarations of this implementation; see ``Component.leave_bus``."""
        await self.gate.withdraw()

    def start_task(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None]:
        """Run the coroutine beside ``serve``; an exit of a class that has replaced another one is its bug."""
        if self.gate.is_first:
            return super().start_task(work, name)
        task = super().start_task(without_exit(work), name)
        task.add_done_callback(lambda _ended: work.close())  # it may be cancelled before it begins
        return task

    def end(self, reason: str) -> None:
        """End the component in good order."""
        present = self.exchanges.present
        if self.gate.is_first and present is not self:  # the process ends the component
            present.end(reason)
        else:
            super().end(reason)

    def fail(self, bug: BaseException) -> None:
        """End because of a bug; the component ends if no other implementation is left."""
        super().fail(bug)
        self.exchanges.failed(self, bug)

    def go_on_from(self, other: Self) -> None:
        """Take over the state of another implementation: exchanges, story, progress, grants and place in the tree."""
        self.exchanges, self.story, self.payload = other.exchanges, other.story, other.payload
        self.tree_version, self.pid, self.start_number = other.tree_version, other.pid, other.start_number
        self.own_arc.go_on_from(other.own_arc)

    def take_charge(self) -> None:
        """Send commands from now on, and keep the ARC."""
        if self.gate.is_open:
            return
        self.gate.open()
        self.own_arc.take_charge()
        self.changed()

    def stand_by(self) -> None:
        """Send no more commands; keep the state and continue to receive notices of grants."""
        self.gate.shut()
        self.own_arc.stand_by()

    @property
    def _in_charge(self) -> Behavior[Any]:
        present = self.exchanges.present
        assert isinstance(present, Behavior)  # noqa: S101  its exchanges are those of a behavior
        return present

    async def connect(self) -> None:
        """Watch the parent: a behavior, or the ordering console. The first step of a path is not a behavior."""
        self.own_reports.connect(self.parameters.keeper)

    async def serve(self) -> None:
        """Start, claim the ARC, start the children; then react to events."""
        keeper = self.own_reports.keeper
        if keeper is not None:
            self.begin_task(self._end_with_keeper(keeper), "keeper")
            await keeper.wait_noted()
        if await self._memory.recall():
            self.begin_task(self._wind_up(), "wind-up")
            return
        await self.start()
        need, other = self.need(), None if self.gate.is_open else self._in_charge.own_arc
        if other is not None:
            self.own_arc.compare(need, other)
        if need is not None and not self.status.is_final:
            await self.own_arc.begin(need, other)
        self.has_begun = True
        self.own_reports.begin()
        self._children.begin()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the ARC, the children, questions about progress and debug views, and ``TakeBranch``."""
        match asked.body:
            case ChildReport(child=child) as report:
                if child not in self.child_nodes or child != component_of(asked.source):
                    raise NotAChild(f"{asked.source} is no child of {self.name}", child=child)
                self._children.reported(child, report.status, report.payload, report.suspended_because)
                return ReportNoted()
            case AskBehavior():
                return state_of(self, self._children.rules, is_last=self.parameters.is_last)
            case TakeBranch() as taken if asked.source == LAUNCHER:
                return await self._take(taken)
            case ListViews():
                return self.views.listed()
            case LookAt() as look:
                return self.views.look(look)
            case BreakOff() if asked.source == self.parameters.keeper:
                self.finish(BehaviorStatus.FAILURE, {"detail": "broken off by its operator"})
                return BrokenOff()
            case TakeBranch() | BreakOff():
                raise NotYourOrder(f"{asked.source} does not order {self.name}", behavior=self.name)
            case body if isinstance(body, ArcNotice):
                return await self.own_arc.answer(asked)
            case _:
                raise UnknownMessage(f"{type(asked.body).__name__} is not answered here")

    async def drain(self) -> None:
        """Give the ARC back.

        The children continue. Only an order to stop this behavior ends them; the placer carries it out. If a signal
        ended this process, the next process of this behavior adopts the children.
        """
        try:
            async with asyncio.timeout(DRAIN_TIME_S):
                await self.own_arc.release()
        except TimeoutError:  # the ARC watches its owner's token and ends by itself
            log.warning("%s leaves before its ARC has ended", self.name)

    def absences(self) -> list[Absence]:
        """Return the missing children and ARC, and the children that are given up."""
        arc = None if self.status.is_final else self.own_arc.absence()
        return [*([] if arc is None else [arc]), *self._children.absences(has_finished=self.status.is_final)]

    def statistics(self) -> dict[str, float]:
        """Return counts of grants and pictures."""
        return self.own_arc.statistics()

    async def _take(self, taken: TakeBranch) -> BranchTaken:
        """Apply the changed branch of the tree; a repeated message waits for the same children to end."""
        if taken.version >= self.tree_version:
            anew = taken.anew if taken.version > self.tree_version else []
            self.tree_version = taken.version
            arc, self.parameters = self.parameters.arc, self.with_parameters(taken.place)
            before, nodes = set(self.child_nodes), {node.name: node for node in self.parameters.children}
            self._left = (self._left | before) - nodes.keys()
            self.child_nodes.clear()
            self.child_nodes.update(nodes)
            if self.own_arc.claimed is not None:
                self.own_arc.claim_as_now(self.need() if self.parameters.arc != arc else None)
            self.story.note(self.name, f"takes its place in version {taken.version} of the tree")
            self.children_changed()
            await self._children.rearranged(self._left, anew)
        return BranchTaken(str(self.status) if self.status.is_final else "")

    def rules_applied(self) -> None:
        """Report the result of the children's rules after an event; see ``BehaviorOfParts``."""
        self.children_arranged()
        self.suspension_changed()
        self.keep_memory()

    async def _wind_up(self) -> None:
        """Release the ARC, end the children, and repeat the report until the parent acknowledges it.

        A behavior that a console ordered keeps its ARC, so that no ARC of lower priority gets the robot before the
        operator.
        """
        if self.status is BehaviorStatus.FAILURE and not (self.own_reports.has_reader or self._children.given_up):
            self._children.give_up(self.name, self.payload)
        await self.own_arc.acting.stop()
        if self.own_reports.keeper is not None:
            await self.own_arc.rest()
            await self._children.end()
        else:
            await asyncio.gather(self.own_arc.release(), self._children.end())
        await self.own_reports.conclude()

    async def _end_with_keeper(self, keeper: KeeperReports) -> None:
        """When the ordering console has ended, release the robot and ask the placer to end this behavior."""
        why_over = await keeper.run()
        self.status = BehaviorStatus.FAILURE
        self.publish_event(self.name, f"ends with its order: {why_over}", LogLevel.NOTICE)
        await self.own_arc.acting.stop()
        await self.own_arc.release()
        await end_by_placer(self.bus, self.clock, self.name, f"its order is over: {why_over}")

    def suspension_changed(self) -> None:
        """Report the reason of the suspension if it has changed; see ``BehaviorOfParts``."""
        self.own_reports.suspension_changed()

    def begin_task(self, work: Coroutine[object, None, Any], name: str) -> asyncio.Task[None] | None:
        """Run the coroutine as a task, unless the component is ending."""
        if self.state is not LifeState.READY:
            work.close()
            return None
        return self.start_task(work, name)
