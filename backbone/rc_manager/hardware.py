"""Hardware: the RCs that the schedule may use are those that the dependency database has.

It is compared when the database publishes a change, starts or comes back, and when a request names an unknown RC; so a
lost message changes nothing for long. A removed RC is down at once. It stays known while a request names it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable

from backbone.addresses import DEPENDENCY_DATABASE
from backbone.bus.interface import Subscription
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.rc_manager.rc_watch import RcWatch, Service
from backbone.rc_manager.recovery import Recovery, rc_known
from backbone.scheduling.events import RcRemoved, RcWentDown
from backbone.scheduling.requests import UnknownRc


class Hardware:
    """Adds RCs to the schedule, and removes them.

    Attributes:
        resources: RC → its resource, also of removed ones that a request still names.
    """

    def __init__(
        self, service: Service, recovery: Recovery, rcs: RcWatch, follow: Callable[[str], Subscription]
    ) -> None:
        """Begin without RCs.

        Args:
            service: The RC manager.
            recovery: Asks the dependency database.
            rcs: Checks RCs that appear; it gets the same resources.
            follow: Subscribes to the published states of an RC.
        """
        self.resources: dict[str, Resource] = {}
        self._service, self._recovery, self._rcs, self._follow = service, recovery, rcs, follow
        rcs.resources = self.resources
        self._removed: set[str] = set()
        self._followed: dict[str, Subscription] = {}
        self._alone = asyncio.Lock()

    async def learn(self) -> None:
        """Learn the hardware at the start."""
        self.resources.update(await self._present())

    def follow_all(self) -> None:
        """Subscribe to the states of all RCs."""
        for rc in self.resources:
            self._followed[rc] = self._follow(rc)

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

    def let_go(self) -> bool:
        """Forget the removed RCs that no request names; return whether one was forgotten."""
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
        return bool(gone)

    def require(self, rcs: Iterable[str]) -> None:
        """Return if none of these RCs was removed.

        Raises:
            UnknownRc: One was.
        """
        for rc in self._removed.intersection(rcs):
            raise UnknownRc(f"{rc} was removed from this mission", rc=rc)

    async def _present(self) -> dict[str, Resource]:
        found = await self._recovery.until_answered(DEPENDENCY_DATABASE, AskResources(), Resources)
        return {resource.name: resource for resource in found.resources}

    def _add(self, resource: Resource) -> None:
        service, rc = self._service, resource.name
        self.resources[rc] = resource
        service.shares.know(rc, service.clock.now_s())
        service.happened(rc_known(resource, None))
        service.story.note(rc, "was added to the hardware")
        self._followed[rc] = self._follow(rc)
        self._rcs.meet_again(rc)

    def _remove(self, rc: str) -> None:
        if rc not in self._removed:
            self._removed.add(rc)
            self._service.story.note(rc, "was removed from the hardware")
        if self._rcs.forget(rc):
            self._service.happened(RcWentDown(rc))


def _is_same(known: Resource, present: Resource) -> bool:
    """Return whether the schedule need not know of the difference: of host, parameters and links."""
    return (known.type, known.sharable, known.connect_s, known.disconnect_s) == (
        present.type,
        present.sharable,
        present.connect_s,
        present.disconnect_s,
    )
