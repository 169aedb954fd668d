"""ChildKeeper: keeps a behavior's children running through the placer; adopts children of an earlier process."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.asking import ask_until_answered
from backbone.component.messages import Absence, LogLevel
from backbone.creator.messages import ProcessFell, creator_name
from backbone.errors import LinkError, Refusal, code_of
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order, node_of
from backbone.naming import Subsystem, address
from backbone.placer.messages import CreatorSilent, Ended, ListPlacements, Placement, Placements, Start, StopComponent
from backbone.placer.wishes import Wish, keep_placed
from backbone.wire import Envelope
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus

log = logging.getLogger(__name__)

REPLY_TIME_S = 1.0  # chosen: parents and placer answer in milliseconds
START_TIME_S = 30.0  # chosen: as for ARCs, because a child's host may be busy
ADOPT_WITHIN_S = 10.0  # chosen: a child that is being restarted answers within this time
START_PATIENCE_S = 60.0  # chosen: a link cut of 30 s, and the attempts that began in it; health reports it meanwhile
AGAIN_AFTER_S = 0.2  # chosen: a restarted placer or parent is back after one or two of these intervals; machine seconds


class ChildKeeper:
    """Starts, adopts and stops the children of one behavior."""

    def __init__(
        self,
        parent: BehaviorOfParts,
        reported: Callable[[str, BehaviorStatus, Mapping[str, object], str], None],
        fell: Callable[[str, str], None],
        left: Callable[[str], None],
    ) -> None:
        """Create a keeper without children.

        Args:
            reported: Called with a child's status, payload and reason of suspension when it finished, cannot run or was
                adopted.
            fell: Called with a child and how its process ended, when its creator restarts it.
            left: Called when an order stopped a child.
        """
        self._parent, self._reported, self._fell, self._left = parent, reported, fell, left
        self._bus, self._clock, self._nodes = parent.bus, parent.clock, parent.child_nodes
        self._kept: dict[str, asyncio.Task[None]] = {}
        self._wishes: dict[str, Wish] = {}
        self._heard_creators: dict[str, Subscription] = {}

    def absences(self) -> list[Absence]:
        """Return the wanted children that do not run."""
        return [absence for wish in self._wishes.values() if (absence := wish.absence()) is not None]

    async def start(self, name: str, order_id: str) -> None:
        """Start the child and keep it running; see ``Launch.order_id``."""
        keeping = self._parent.begin_task(self._keep_child(name, order_id), f"child {name}")
        if keeping is not None:
            self._kept[name] = keeping

    async def _keep_child(self, name: str, order_id: str) -> None:
        """Keep the child running until an order stops it; adopt a child of an earlier process of this behavior."""
        node = self._nodes.get(name)
        if node is None:  # the child left the tree before its start
            return
        wish, at = Wish(name, order_id=order_id), address(Subsystem.MISSION_CONTROL, name)
        self._wishes[name], latest = wish, node

        def order() -> Start:
            nonlocal latest
            latest = self._nodes.get(name, latest)
            return behavior_order(node_of(latest), self._parent.path)

        try:
            stopped = await keep_placed(
                self._bus,
                self._clock,
                wish,
                order,
                at,
                on_placed=self._child_placed,
                on_changed=self._parent.changed,
                patience_s=START_PATIENCE_S,
            )
        except Refusal as refusal:
            self._parent.publish_event(name, f"could not be started: {refusal}", LogLevel.WARNING)
            self._reported(name, BehaviorStatus.FAILURE, why(refusal), "")
            return
        self._parent.publish_event(name, f"is not wanted any more: {stopped}")
        del self._kept[name], self._wishes[name]
        self._left(name)

    def _child_placed(self, placement: Placement, was_there: bool) -> None:
        self._hear_creator(placement.host)
        if was_there:
            self._parent.story.note(placement.name, "was running and is adopted")
            self._parent.begin_task(self._adopt(placement.name), f"adopt {placement.name}")

    async def _adopt(self, name: str) -> None:
        """Ask an adopted child for its progress."""
        child = address(Subsystem.MISSION_CONTROL, name)
        try:
            state = await ask_until_answered(
                self._bus,
                self._clock,
                child,
                AskBehavior(),
                BehaviorState,
                each_s=REPLY_TIME_S,
                within_s=ADOPT_WITHIN_S,
            )
        except (LinkError, Refusal) as error:  # the child is restarting, and then runs from its beginning
            log.info("child %s does not report its progress: %s", name, error)
            return
        self._reported(name, state.status, state.payload, state.suspended_because)

    async def stop_those_of_an_earlier_life(self, started: Callable[[str], bool]) -> None:
        """Stop running children of an earlier process of the owner that this process does not start.

        Args:
            started: Name of a child → whether this process has started it.
        """
        try:
            placed = await ask_until_answered(
                self._bus,
                self._clock,
                PLACER,
                ListPlacements(),
                Placements,
                each_s=REPLY_TIME_S,
                within_s=ADOPT_WITHIN_S,
            )
        except LinkError as error:
            log.warning("%s does not know which children it left running: %s", self._parent.name, error)
            return
        mine = [
            each.name for each in placed.placements if each.requester == self._bus.source and each.name in self._nodes
        ]
        await asyncio.gather(*(self.stop(name) for name in mine if not started(name)))

    async def stop(self, name: str) -> None:
        """Return when the placer has ended the child, or does not know it."""
        await end_task(self._kept.pop(name, None))
        self._wishes.pop(name, None)
        await end_by_placer(self._bus, self._clock, name, f"{self._parent.name} ends it")

    def _hear_creator(self, host: str) -> None:
        if host not in self._heard_creators:
            creator = address(Subsystem.BACKBONE, creator_name(host))
            self._heard_creators[host] = self._bus.subscribe(
                creator, Conversation.EVENTS, ProcessFell, self._heard_fall
            )

    def _heard_fall(self, envelope: Envelope[ProcessFell]) -> None:
        fell = envelope.body
        if fell.name not in self._nodes:
            return
        if fell.failing:
            fell_too_often = {"code": "child.given_up", "detail": f"{fell.name} fell too often: {fell.how}"}
            self._reported(fell.name, BehaviorStatus.FAILURE, fell_too_often, "")
        else:
            self._fell(fell.name, fell.how)


async def end_by_placer(bus: Bus, clock: Clock, name: str, reason: str) -> None:
    """Return when the placer has ended the component of this name, or does not know it."""
    while True:
        try:
            await bus.ask(PLACER, StopComponent(name, reason), Ended, within_s=START_TIME_S)
        except (LinkError, CreatorSilent) as error:
            log.info("%s is not stopped yet: %s", name, error)
        except Refusal as refusal:
            log.info("%s: %s", name, refusal)
            return
        else:
            return
        await clock.sleep_s(AGAIN_AFTER_S * clock.rate)


async def end_task(task: asyncio.Task[None] | None) -> None:
    """Cancel a task and return when it has ended; its task group handles a bug in it."""
    if task is not None and task is not asyncio.current_task():
        task.cancel()
        await asyncio.wait({task})


def why(refusal: Refusal) -> dict[str, object]:
    """Return a refusal as the payload of a report."""
    return {"code": code_of(refusal), "detail": refusal.detail, "remedy": refusal.remedy}
