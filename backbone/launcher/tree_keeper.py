"""TreeKeeper: owns the behavior tree of a running mission, and applies changes of the tree to the mission.

Rule of this file: a change is checked as a whole and then carried out. A refused change changes nothing. If a behavior
cannot be reached during the change, it gets its new place as soon as it appears again.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Protocol

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.interface import Bus, Clock, Reply
from backbone.component.asking import ask_until_answered
from backbone.component.messages import Parameters, SetParameter
from backbone.errors import LinkError, OutcomeUnknown, Refusal
from backbone.launcher.messages import (
    AddBranch,
    BranchTaken,
    SetInTree,
    TakeBranch,
    Tree,
    TreeChange,
    TreeChanged,
    TreeChangedMeanwhile,
)
from backbone.launcher.tree_changes import (
    PRIORITY,
    RUN_TIMES,
    ChangedMission,
    Consequences,
    NewPlace,
    consequences,
    orders,
)
from backbone.mission.behavior_orders import PLACE_PARAMETERS
from backbone.mission.model import MissionDescription
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import CreatorSilent, Ended, NotPlaced, ReviseStart, Start, StartRevised, StopComponent
from backbone.rc_manager.messages import AskAttributes, Done, SetPriority
from backbone.scheduling.requests import UnknownRequest
from backbone.scheduling.views import Attributes
from backbone.wire import Message

log = logging.getLogger(__name__)

REPLY_TIME_S = 2.0  # chosen: services and behaviors answer in milliseconds
REPLIES_WITHIN_S = 10.0  # chosen: a restarted service is back long before
ENDS_WITHIN_S = 20.0  # chosen: longer than the placer takes to end a component that hangs
AGAIN_AFTER_S = 0.2  # chosen: a restarted behavior is back within one or two of these; machine seconds


class BeginRoot(Protocol):
    """Type of ``WishKeeper.begin_root``."""

    def __call__(self, order: Start, /, *, insists: bool) -> Awaitable[None]:
        """Keep the root of this order running from now on."""


class TreeKeeper:
    """Answers questions about the tree and carries out its changes.

    Args:
        description: The mission as it came up.
        text: Content of its mission file.
        begin_root: Keeps a root running from now on; see ``WishKeeper.begin_root``.
        leave_root: Stops keeping a root running.
        begin: Runs work as a task of the launcher.
        note: Writes an event to the story; arguments: subject, event.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        description: MissionDescription,
        text: bytes,
        *,
        begin_root: BeginRoot,
        leave_root: Callable[[str], Awaitable[None]],
        begin: Callable[[Coroutine[object, None, None], str], object],
        note: Callable[[str, str], object],
    ) -> None:
        self.description = description
        """The mission with all changes."""
        self.text = text
        """Its mission file with all changes."""
        self.version = 0
        """Number of changes since it came up."""
        self._orders_of: MissionDescription | None = None
        self._orders: dict[str, Start] = {}
        self._bus, self._clock, self._begin_root, self._leave_root = bus, clock, begin_root, leave_root
        self._begin, self._note = begin, note
        self._one_at_a_time = asyncio.Lock()
        self._alive: set[str] = set()
        self._moved: set[str] = set()  # behaviors whose place has changed since the mission came up
        self._owed: dict[str, set[str]] = {}  # behavior → children that it must start again, but has not yet

    def watch(self) -> None:
        """From now on send each behavior that appears its place, if that has changed."""
        self._bus.watch_alive(f"{Subsystem.MISSION_CONTROL}/*", self._token_changed)

    def tree(self) -> Tree:
        """Return the present tree."""
        return Tree(self.version, self.text.decode())

    def newest(self, order: Start) -> Start:
        """Return the order as the tree is now, of a behavior of the tree; any other order as it is."""
        return self.order(order.name) or order

    def order(self, name: str) -> Start | None:
        """Return the order that starts this behavior of the present tree; None: the tree has no such behavior."""
        return self._orders_now().get(name)

    async def change(self, change: TreeChange, user: str) -> TreeChanged:
        """Change the tree and return its new version.

        Args:
            user: Address of the operator.

        Raises:
            Refusal: The change is refused; nothing is changed.
        """
        async with self._one_at_a_time:
            return await self._change(change, user)

    def _orders_now(self) -> dict[str, Start]:
        """Return the order of each behavior of the tree; each start asks for one, so they are kept."""
        if self._orders_of is not self.description:
            self._orders_of, self._orders = self.description, orders(self.description)
        return self._orders

    async def _change(self, change: TreeChange, user: str) -> TreeChanged:
        if change.version != self.version:
            raise TreeChangedMeanwhile(
                f"the tree has version {self.version}, and the change is for {change.version}", version=self.version
            )
        new = await asyncio.to_thread(_applied, self.text, change, self.description.source)
        follows = consequences(self.description, new.mission, new.anew)
        if isinstance(change, SetInTree):
            await self._set(change, new.value, user)
        before = self.description, self.text, self.version
        self.description, self.text, self.version = new.mission, new.text, self.version + 1
        self._moved |= {told.order.name for told in follows.told}
        for told in follows.told:
            self._owed.setdefault(told.order.name, set()).update(told.anew)
        try:
            remarks = await self._carry_out(follows, insists=not isinstance(change, AddBranch))
        except Refusal:  # the start of a new root was refused; it is the first action of its change
            self.description, self.text, self.version = before
            raise
        self._note(self.description.name, f"{user} changed the tree, which has version {self.version} now")
        return TreeChanged(self.version, remarks)

    async def _carry_out(self, follows: Consequences, *, insists: bool) -> list[str]:
        """End removed branches, start new ones, and inform those that stay; return remarks for the operator.

        Args:
            insists: True: if a root does not start at once, it stays wanted and counts as absent.

        Raises:
            Refusal: A new root did not start; it is not wanted then.
        """
        await asyncio.gather(*(self._revise(told) for told in follows.told))
        remarks = [await self._tell(told) for told in follows.told if told.gone]
        for name in follows.ended:
            await self._leave_root(name)
        gone = [*follows.ended, *(name for told in follows.told for name in told.gone)]
        remarks += await asyncio.gather(*map(self._end, gone))
        remarks += await asyncio.gather(*(self._number(*item) for item in follows.priorities.items()))
        for order in follows.begun:
            await self._begin_root(order, insists=insists)
        remarks += [await self._tell(told) for told in follows.told if not told.gone]
        return [remark for remark in remarks if remark]

    async def _end(self, name: str) -> str:
        """End a removed branch, even if its parent cannot; return a remark for the operator."""
        try:
            async with asyncio.timeout(ENDS_WITHIN_S):
                await self._end_until_ended(name)
        except TimeoutError:
            self._begin(self._end_until_ended(name), f"end {name}")
            return f"whether {name} still runs is not known; it is ended as soon as it can be reached"
        return ""

    async def _end_until_ended(self, name: str) -> None:
        while True:
            try:
                await self._bus.ask(PLACER, StopComponent(name, "it left the tree"), Ended, within_s=ENDS_WITHIN_S)
            except (LinkError, CreatorSilent) as error:
                log.info("%s is not ended yet: %s", name, error)
            except Refusal:  # the component is not placed, because its parent has ended it
                return
            else:
                return
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    async def _revise(self, told: NewPlace) -> None:
        """Make its next start use the new order; the parent starts a component that is not placed."""
        name = told.order.name
        try:
            await self._ask(PLACER, ReviseStart(name, dict(told.revised), others_stay=True), StartRevised)
        except NotPlaced:
            return
        except (LinkError, Refusal) as error:  # when it appears again, it gets its place
            log.warning("%s: its order is not revised: %s", name, error)

    async def _tell(self, told: NewPlace) -> str:
        """Send a running behavior its place; return a remark for the operator."""
        name = told.order.name
        try:
            async with asyncio.timeout(ENDS_WITHIN_S):
                return await self._tell_until_noted(name)
        except TimeoutError:
            self._begin(self._tell_later(name), f"tell {name}")
            return f"{name} does not answer; it hears of its children when it does"

    async def _tell_later(self, name: str) -> None:
        await self._tell_until_noted(name)

    async def _tell_until_noted(self, name: str) -> str:
        """Return when the behavior has accepted its place, or does not run."""
        at = address(Subsystem.MISSION_CONTROL, name)
        while at in self._alive and (order := self._orders_now().get(name)) is not None:
            owed = self._owed.get(name, set())
            place = {key: order.parameters[key] for key in PLACE_PARAMETERS}
            take = TakeBranch(self.version, place, sorted(owed))
            try:
                taken = await self._bus.ask(at, take, BranchTaken, within_s=ENDS_WITHIN_S)
            except LinkError as error:
                log.info("%s does not take its place yet: %s", name, error)
            except Refusal as refusal:
                return f"{name} refuses its place: {refusal}"
            else:
                self._owed.pop(name, None)
                return f"{name} has finished ({taken.finished}) and starts nothing any more" if taken.finished else ""
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)
        return ""

    def _token_changed(self, at: str, stands: bool) -> None:
        if not stands:
            self._alive.discard(at)
            return
        self._alive.add(at)
        if (name := component_of(at)) in self._moved:
            self._begin(self._tell_later(name), f"tell {name}")

    async def _set(self, change: SetInTree, value: object, user: str) -> None:
        """Send the value to its present user: a run time to the ARC, a parameter to the behavior.

        A priority goes to the RC manager with the other consequences.

        Raises:
            Refusal: The component rejects the value, or the outcome is unknown.
        """
        name, parameter = change.name, change.parameter
        if parameter == PRIORITY:
            return
        at = [address(Subsystem.MISSION_CONTROL, name)]
        if parameter in RUN_TIMES:
            at = [address(Subsystem.RESOURCE_POOL, arc) for arc in await self._arcs_of(name)]
        for one in at:
            if one in self._alive or parameter in RUN_TIMES:
                try:
                    await self._bus.ask(one, SetParameter(parameter, value, user), Parameters, within_s=REPLY_TIME_S)
                except LinkError as error:
                    raise OutcomeUnknown(f"{component_of(one)} does not confirm {parameter}: {error}") from error

    async def _arcs_of(self, name: str) -> list[str]:
        try:
            found = await self._ask(RC_MANAGER, AskAttributes(name), Attributes)
        except UnknownRequest:
            return []
        except LinkError as error:
            raise OutcomeUnknown(f"the RC manager does not answer what {name} claims: {error}") from error
        return [request.arc for request in found.requests if component_of(request.owner) == name]

    async def _number(self, name: str, priority: int) -> str:
        """Set a priority as an operator does; return a remark for the operator."""
        try:
            await self._ask(RC_MANAGER, SetPriority(name, priority), Done)
        except LinkError as error:
            return f"the RC manager did not confirm that {name} has priority {priority}: {error}"
        return ""

    async def _ask(self, at: str, question: Message, reply: type[Reply]) -> Reply:
        return await ask_until_answered(
            self._bus, self._clock, at, question, reply, each_s=REPLY_TIME_S, within_s=REPLIES_WITHIN_S
        )


def _applied(text: bytes, change: TreeChange, source: str) -> ChangedMission:
    """Return the mission after the change; see ``tree_texts.applied``, which this process imports only now."""
    found: ChangedMission = importlib.import_module("backbone.launcher.tree_texts").applied(text, change, source)
    return found
