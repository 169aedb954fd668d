"""TreeKeeper: owns the behavior tree of a running mission, and has the mission follow its changes.

Rule of this file: a change is checked as a whole and then carried out; what is refused changed nothing. Who cannot be
reached meanwhile hears of it as soon as it is back, because each behavior that appears is told of its place.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine

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
    Consequences,
    EditedFile,
    NewPlace,
    changed,
    consequences,
    orders,
    written,
)
from backbone.mission.behavior_orders import PLACE_PARAMETERS
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from backbone.mission.report import MissionInvalid
from backbone.mission.tables import parameter_value
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import (
    CreatorSilent,
    Ended,
    NotPlaced,
    ReviseStart,
    Start,
    StartRevised,
    StopComponent,
)
from backbone.rc_manager.messages import AskAttributes, Done, SetPriority
from backbone.scheduling.requests import UnknownRequest
from backbone.scheduling.views import Attributes
from backbone.wire import Message

log = logging.getLogger(__name__)

REPLY_TIME_S = 2.0  # chosen: services and behaviors answer in milliseconds
REPLIES_WITHIN_S = 10.0  # chosen: a restarted service is back long before
ENDS_WITHIN_S = 20.0  # chosen: longer than the placer takes to end a component that hangs
AGAIN_AFTER_S = 0.2  # chosen: a restarted behavior is back within one or two of these; machine seconds


class TreeKeeper:
    """Answers questions about the tree and carries its changes out.

    Args:
        bus: Bus of the launcher.
        clock: The mission's clock.
        description: The mission as it came up.
        text: What its file holds.
        begin_root: Keeps a root running from now on; returns when it runs, or raises the refusal of its first start.
        leave_root: Keeps a root running no longer.
        begin: Runs work as a task of the launcher.
        note: Subject, event → the story.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        description: MissionDescription,
        text: bytes,
        *,
        begin_root: Callable[[Start], Awaitable[None]],
        leave_root: Callable[[str], Awaitable[None]],
        begin: Callable[[Coroutine[object, None, None], str], object],
        note: Callable[[str, str], object],
    ) -> None:
        self.description = description
        """The mission as it is now."""
        self.text = text
        """Its file as it is now."""
        self.version = 0
        """Number of changes since it came up."""
        self._orders_of: MissionDescription | None = None
        self._orders: dict[str, Start] = {}
        self._bus, self._clock, self._begin_root, self._leave_root = bus, clock, begin_root, leave_root
        self._begin, self._note = begin, note
        self._one_at_a_time = asyncio.Lock()
        self._alive: set[str] = set()
        self._moved: set[str] = set()  # behaviors whose place has changed since the mission came up
        self._owed: dict[str, set[str]] = {}  # behavior → children that begin anew as soon as it hears of it

    def watch(self) -> None:
        """From now on tell each behavior that appears of its place, if that has changed."""
        self._bus.watch_alive(f"{Subsystem.MISSION_CONTROL}/*", self._token_changed)

    def tree(self) -> Tree:
        """Return the tree as it is now."""
        return Tree(self.version, self.text.decode())

    def newest(self, order: Start) -> Start:
        """Return the order as the tree is now, of a behavior of the tree; any other order as it is."""
        return self._orders_now().get(order.name, order)

    async def change(self, change: TreeChange, user: str) -> TreeChanged:
        """Change the tree and return its new version.

        Args:
            user: Address of who asks.

        Raises:
            Refusal: Nothing is changed.
        """
        async with self._one_at_a_time:
            return await self._change(change, user)

    def _orders_now(self) -> dict[str, Start]:
        """Return the order of each behavior of the tree; each start asks for one, so they are kept."""
        if self._orders_of is not self.description:
            self._orders_of, self._orders = self.description, orders(self.description)
        return self._orders

    # ------------------------------------------------------------------ one change
    async def _change(self, change: TreeChange, user: str) -> TreeChanged:
        if change.version != self.version:
            raise TreeChangedMeanwhile(
                f"the tree has version {self.version}, and the change is for {change.version}", version=self.version
            )
        edited = changed(self.text, change)
        new = await self._checked(edited)
        follows = consequences(self.description, new, edited.anew)
        if isinstance(change, SetInTree):
            await self._set(change, user)
        before = self.description, self.text, self.version
        self.description, self.text, self.version = new, edited.text, self.version + 1
        self._moved |= {told.order.name for told in follows.told}
        for told in follows.told:
            self._owed.setdefault(told.order.name, set()).update(told.anew)
        try:
            remarks = await self._carry_out(follows, insists=not isinstance(change, AddBranch))
        except Refusal:  # of the start of a new root, before which nothing else was done
            self.description, self.text, self.version = before
            raise
        self._note(self.description.name, f"{user} changed the tree, which has version {self.version} now")
        return TreeChanged(self.version, remarks)

    async def _checked(self, edited: EditedFile) -> MissionDescription:
        """Return the mission that this text describes; check it as 'scout-backbone check' does."""
        try:
            return await asyncio.to_thread(read_mission_bytes, edited.text, self.description.source)
        except MissionInvalid as invalid:
            raise edited.invalid(invalid.faults) from None

    async def _carry_out(self, follows: Consequences, *, insists: bool) -> list[str]:
        """End what is gone, begin what is new, and tell those that stay; return what an operator should know.

        Args:
            insists: True: a root that is not started at once stays wanted, and is absent meanwhile.

        Raises:
            Refusal: A new root was not started; there is no such wish then.
        """
        await asyncio.gather(*(self._revise(told.order) for told in follows.told))
        remarks = [await self._tell(told) for told in follows.told if told.gone]
        for name in follows.ended:
            await self._leave_root(name)
        gone = [*follows.ended, *(name for told in follows.told for name in told.gone)]
        remarks += await asyncio.gather(*map(self._end, gone))
        remarks += await asyncio.gather(*(self._number(*item) for item in follows.priorities.items()))
        for order in follows.begun:
            if insists:
                self._begin(self._begin_root_at_last(order), f"begin {order.name}")
            else:
                await self._begin_root(order)
        remarks += [await self._tell(told) for told in follows.told if not told.gone]
        return [remark for remark in remarks if remark]

    async def _begin_root_at_last(self, order: Start) -> None:
        """Keep the root running from now on, however often its start is refused."""
        while self._orders_now().get(order.name) == order:
            try:
                await self._begin_root(order)
            except Refusal as refusal:
                self._note(order.name, f"is not started: {refusal}")
            else:
                return
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    async def _end(self, name: str) -> str:
        """End a branch that the tree has no more, also if its parent cannot; return what an operator should know."""
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
            except Refusal:  # the placer does not have it: its parent has ended it
                return
            else:
                return
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    # ------------------------------------------------------------------ those that stay
    async def _revise(self, order: Start) -> None:
        """Have its next life begin with the new order; a component that is not placed gets it from its parent."""
        try:
            await self._ask(PLACER, ReviseStart(order.name, order.parameters), StartRevised)
        except NotPlaced:
            return
        except (LinkError, Refusal) as error:  # its next life hears of its place when it appears
            log.warning("%s: its order is not revised: %s", order.name, error)

    async def _tell(self, told: NewPlace) -> str:
        """Tell a behavior that runs of its place; return what an operator should know."""
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
        """Return when the behavior has taken its place, or does not run."""
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

    # ------------------------------------------------------------------ values
    async def _set(self, change: SetInTree, user: str) -> None:
        """Give the value to who uses it now: a run time to the ARC, a parameter to the behavior.

        A priority goes to the RC manager with the other consequences.

        Raises:
            Refusal: It does not take the value, or it is unknown whether it did.
        """
        name, parameter = change.name, change.parameter
        value = parameter_value(written(name, parameter, change.value))
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
            raise OutcomeUnknown(f"the RC manager does not say what {name} claims: {error}") from error
        return [request.arc for request in found.requests if component_of(request.owner) == name]

    async def _number(self, name: str, priority: int) -> str:
        """Set a priority as every operator does; return what an operator should know."""
        try:
            await self._ask(RC_MANAGER, SetPriority(name, priority), Done)
        except LinkError as error:
            return f"the RC manager did not confirm that {name} has priority {priority}: {error}"
        return ""

    async def _ask(self, at: str, question: Message, reply: type[Reply]) -> Reply:
        return await ask_until_answered(
            self._bus, self._clock, at, question, reply, each_s=REPLY_TIME_S, within_s=REPLIES_WITHIN_S
        )
