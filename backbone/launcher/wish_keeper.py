"""Wish keeper: from the first start on, the launcher keeps the components of the mission file running."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable

from backbone.component.component import AnyComponent
from backbone.component.messages import Absence
from backbone.component.peer_monitor import PeerMonitor
from backbone.creator.messages import StartFailed
from backbone.errors import Refusal
from backbone.launcher.other_hosts import OtherHosts
from backbone.mission.model import MissionDescription
from backbone.naming import address
from backbone.placer.messages import NoHost, Placement, Start
from backbone.placer.wishes import Wish, keep_placed
from backbone.waiting import end_tasks

MEET_TIME_S = 5.0  # chosen: the placer knows a creator milliseconds after its token appears, or later on a busy machine
MEET_EACH_S = 0.1  # chosen: too short to notice, and a hundred times as long as a question takes


class WishKeeper:
    """The wishes for hardware, units and roots of the behavior tree, each with a loop that fulfills it.

    Args:
        launcher: Owns the wishes.
        newest: Returns an order with its place in the present tree.
    """

    def __init__(
        self,
        launcher: AnyComponent,
        description: MissionDescription,
        others: OtherHosts,
        newest: Callable[[Start], Start],
    ) -> None:
        self._launcher, self._description, self._others, self._newest = launcher, description, others, newest
        self._wishes: list[Wish] = []
        self._keeping: dict[str, asyncio.Task[None]] = {}
        self.awaited: set[str] = set()
        """Names of the wanted components that were not placed yet."""

    def absences(self) -> list[Absence]:
        """Return the components that are wanted and missing."""
        return [absence for wish in self._wishes if (absence := wish.absence()) is not None]

    async def start_all(self, orders: list[Start]) -> None:
        """Start all components and keep them running; return when all run.

        Raises:
            Refusal: The first refusal of a start.
        """
        await asyncio.gather(*map(self._begin_keeping, orders))

    def _begin_keeping(self, order: Start, patience_s: float = 0.0) -> asyncio.Future[None]:
        """Keep the component running from now on; the future resolves when it runs, or to the refusal of its start.

        Args:
            patience_s: Time in which a refused start is repeated, seconds of the machine.
        """
        placed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        keeping = self._keep(order, placed, patience_s)
        self._keeping[order.name] = self._launcher.start_task(keeping, f"keep {order.name}")
        return placed

    async def begin_root(self, order: Start, *, insists: bool) -> None:
        """Start a root of the changed tree and keep it running.

        Args:
            insists: True: it is wanted, and absent, however often its start is refused; nothing waits for it.

        Raises:
            Refusal: The root did not start, and is not wanted.
        """
        if insists:
            self._begin_keeping(order, math.inf)
            return
        try:
            await self._begin_keeping(order)
        except Refusal:
            await self.leave_root(order.name)
            raise

    async def leave_root(self, name: str) -> None:
        """Stop keeping a root running."""
        if (keeping := self._keeping.pop(name, None)) is not None:
            await end_tasks(keeping)
        self.awaited.discard(name)
        self._launcher.changed()

    async def _keep(self, order: Start, placed: asyncio.Future[None], patience_s: float) -> None:
        """Fulfill one wish of the mission file; an order to stop suspends it until the component is started again."""

        def now_placed(_placement: Placement, _was_there: bool) -> None:
            self.awaited.discard(order.name)
            if not placed.done():
                placed.set_result(None)

        self.awaited.add(order.name)
        subsystem = next(each.subsystem for each in self._description.types if each.name == order.type)
        component = address(subsystem, order.name)
        while True:
            try:
                stopped = await self.keep_once(
                    order, component, now_placed, was_started=placed.done(), patience_s=patience_s
                )
            except Refusal as refusal:
                placed.set_exception(refusal)
                return
            if not placed.done():  # stopped before it ran: the bring-up does not wait for it
                placed.set_result(None)
            self.awaited.discard(order.name)
            self._launcher.publish_event(order.name, f"is not wanted any more: {stopped}")
            monitor = PeerMonitor(self._launcher.bus, component)
            try:
                await monitor.wait_there()
            finally:
                monitor.close()

    async def keep_once(
        self,
        order: Start,
        at: str,
        on_placed: Callable[[Placement, bool], None] = lambda _placement, _was_there: None,
        *,
        was_started: bool = False,
        patience_s: float = 0.0,
    ) -> str:
        """Keep a component placed; return the reason of the order that stopped it.

        A refused first start is repeated while another machine is missing or is new to the placer.

        Args:
            at: Address of the component.
            on_placed: See ``keep_placed``.
            was_started: True: the component ran before.
            patience_s: See ``keep_placed``.

        Raises:
            Refusal: The component did not start.
        """
        bus, clock, changed = self._launcher.bus, self._launcher.clock, self._launcher.changed
        wish = Wish(order.name, started=was_started, order_id=f"{clock.now_s():.6f}")
        self._wishes.append(wish)
        until_s = time.monotonic() + MEET_TIME_S
        try:
            while True:
                try:
                    return await keep_placed(
                        bus, clock, wish, lambda: self._newest(order), at, on_placed, changed, patience_s
                    )
                except (NoHost, StartFailed):
                    if not self._others.names or (not self._others.missing and time.monotonic() >= until_s):
                        raise
                if self._others.missing:
                    until_s = time.monotonic() + MEET_TIME_S
                await clock.sleep_s(MEET_EACH_S * clock.rate)
        finally:
            self._wishes.remove(wish)
