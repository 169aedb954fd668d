"""Hardware: keeps the RCs in the schedule equal to those in the dependency database.

They are compared when the database publishes a change, starts or comes back, when a request names an unknown RC, and
periodically. So a lost message has no lasting effect. A removed RC is down at once. It stays known while a request
names it.
"""

from __future__ import annotations

import asyncio

from backbone.addresses import DEPENDENCY_DATABASE
from backbone.bus.interface import Subscription
from backbone.dependency_database.messages import AskResources, HardwareChanged, Resource, Resources
from backbone.keys import Conversation
from backbone.rc_manager.context_switch import in_pool
from backbone.rc_manager.messages import RcState
from backbone.rc_manager.rc_watch import RcWatch, Service
from backbone.rc_manager.recovery import Recovery, rc_known
from backbone.scheduling.events import RcRemoved, RcWentDown
from backbone.scheduling.requests import SchedulingRequest, UnknownRc
from backbone.wire import Envelope

COMPARE_EVERY_S = 20.0  # chosen: published changes are compared at once; this covers lost messages


class Hardware:
    """Adds RCs to the schedule, and removes them.

    Attributes:
        resources: RC → its resource, also of removed ones that a request still names.
    """

    def __init__(self, service: Service, recovery: Recovery, rcs: RcWatch) -> None:
        """Begin without RCs.

        Args:
            service: The RC manager.
            recovery: Asks the dependency database.
            rcs: Checks RCs that appear; it gets the same resources.
        """
        self.resources: dict[str, Resource] = {}
        self._service, self._recovery, self._rcs = service, recovery, rcs
        rcs.resources = self.resources
        self._removed: set[str] = set()
        self._followed: dict[str, Subscription] = {}
        self._alone = asyncio.Lock()

    async def learn(self) -> None:
        """Read the hardware at the start."""
        self.resources.update(await self._present())

    def follow(self) -> None:
        """Subscribe to the states of all RCs and to changes of the hardware."""
        for rc in self.resources:
            self._follow_rc(rc)
        self._service.bus.subscribe(DEPENDENCY_DATABASE, Conversation.EVENTS, HardwareChanged, self._heard_change)

    async def keep_comparing(self) -> None:
        """Compare at once, because a change may have come before ``follow``, and then every ``COMPARE_EVERY_S``."""
        while True:
            await self.compare()
            await self._service.clock.sleep_s(COMPARE_EVERY_S * self._service.clock.rate)

    def compare_soon(self) -> None:
        """Compare in a task of its own."""
        self._service.start_task(self.compare(), "compare hardware")

    async def compare(self) -> None:
        """Add RCs that are new, and count removed ones as down."""
        async with self._alone:
            present = await self._present()
            for rc, known in self.resources.items():
                if rc not in present or not _is_same(known, present[rc]):
                    self._remove(rc)
                    continue
                self.resources[rc] = present[rc]
                if rc in self._removed:
                    self._removed.discard(rc)
                    self._rcs.meet_again(rc)
            self.let_go()
            for rc in present.keys() - self.resources.keys():
                self._add(present[rc])

    async def choose(self, request: SchedulingRequest) -> tuple[str, ...]:
        """Return the set of RCs that this request should wait for, including RCs added a moment ago.

        Raises:
            UnknownRc: An RC was removed, or never existed.
            SchedulingRefusal: See ``ScheduleManager.choose``.
        """
        try:
            rcs = self._service.manager.choose(request)
        except UnknownRc:
            await self.compare()
            rcs = self._service.manager.choose(request)
        for rc in self._removed.intersection(rcs):
            raise UnknownRc(f"{rc} was removed from this mission", rc=rc)
        return rcs

    def let_go(self) -> None:
        """Forget the removed RCs that no request names, and compare again, because a new RC may have such a name."""
        gone: list[str] = []
        for rc in sorted(self._removed) if not self._service.is_choosing() else ():
            self._service.happened(RcRemoved(rc))
            if not self._service.manager.knows(rc):
                gone.append(rc)
        for rc in gone:
            self._removed.discard(rc)
            del self.resources[rc]
            self._followed.pop(rc).close()
            self._service.shares.forget(rc)
        if gone:
            self.compare_soon()

    async def _present(self) -> dict[str, Resource]:
        found = await self._recovery.until_answered(DEPENDENCY_DATABASE, AskResources(), Resources)
        return {resource.name: resource for resource in found.resources}

    def _add(self, resource: Resource) -> None:
        service, rc = self._service, resource.name
        self.resources[rc] = resource
        service.shares.know(rc, service.clock.now_s())
        service.happened(rc_known(resource, None))
        service.story.note(rc, "was added to the hardware")
        self._follow_rc(rc)
        self._rcs.meet_again(rc)

    def _follow_rc(self, rc: str) -> None:
        service = self._service
        self._followed[rc] = service.bus.subscribe(in_pool(rc), Conversation.TELEMETRY, RcState, service.heard_rc)

    def _heard_change(self, _change: Envelope[HardwareChanged]) -> None:
        self.compare_soon()

    def _remove(self, rc: str) -> None:
        if rc not in self._removed:
            self._removed.add(rc)
            self._service.story.note(rc, "was removed from the hardware")
        if self._rcs.forget(rc):
            self._service.happened(RcWentDown(rc))


def _is_same(known: Resource, present: Resource) -> bool:
    """Return whether the resources differ at most in ways that do not concern the schedule: host, parameters, links."""
    return (known.type, known.sharable, known.connect_s, known.disconnect_s) == (
        present.type,
        present.sharable,
        present.connect_s,
        present.disconnect_s,
    )
