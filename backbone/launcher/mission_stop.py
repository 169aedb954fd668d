"""The end of a mission's parts: consoles, behaviors, ARCs and hardware, and the creators of other machines."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Collection, Iterable

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.interface import Bus
from backbone.component.messages import Stop, Stopping
from backbone.creator.messages import ProcessEnded
from backbone.errors import LinkError, Refusal
from backbone.launcher.other_hosts import OtherHosts
from backbone.mission.behavior_orders import behavior_orders
from backbone.mission.model import MissionDescription
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem
from backbone.placer.messages import Ended, ListPlacements, Placement, Placements, StopComponent

log = logging.getLogger(__name__)

STOP_TIME_S = 10.0  # chosen: request, SIGTERM and SIGKILL take 2 s in all; a busy machine takes longer
SOON_S = 1.0  # chosen: a thousand round trips
REASON = "the mission ends"


async def stop_consoles(bus: Bus) -> None:
    """Ask every console to stop; each console releases its robot. No console is reached without a nameserver."""
    with contextlib.suppress(LinkError):
        question = ListComponents(subsystem=Subsystem.UI_CONSOLE)
        listing = await bus.ask(NAMESERVER, question, Components, within_s=SOON_S)
        await _ask_to_stop(bus, [console.address for console in listing.components])


class MissionStop:
    """Stops the parts that the placer has placed.

    Args:
        ended: Gets the end of each part that the placer confirmed.
    """

    def __init__(self, bus: Bus, ended: Callable[[ProcessEnded], None]) -> None:
        self._bus, self._ended = bus, ended

    async def stop_all(self, description: MissionDescription, last_branch: str) -> None:
        """Stop behaviors first (each stops its children), then the remaining ARCs, then hardware.

        Args:
            last_branch: Name of the branch with which the mission ended; empty: none.
        """
        resources = [resource.name for resource in description.resources]
        components = [component.name for component in description.components]
        if last_branch:
            await self._stop(last_branch)
        await self.stop_roots(description)
        await self.stop_placed(lambda placed: placed.name not in {*resources, *components})
        for hardware in (resources, components):
            await asyncio.gather(*(self._stop(name) for name in hardware))

    async def stop_roots(self, description: MissionDescription) -> None:
        """Stop all roots at once, so that a root on a host that is cut off delays no other root."""
        roots = reversed(behavior_orders(description))
        await asyncio.gather(*(self._stop(order.name) for order in roots))

    async def stop_placed(self, is_meant: Callable[[Placement], bool]) -> None:
        """Stop the components that the placer has placed and that are meant."""
        with contextlib.suppress(LinkError, Refusal):  # without a placer the creators end the rest
            there = await self._bus.ask(PLACER, ListPlacements(), Placements, within_s=SOON_S)
            await asyncio.gather(*(self._stop(placed.name) for placed in there.placements if is_meant(placed)))

    async def _stop(self, name: str) -> None:
        try:
            ended = await self._bus.ask(PLACER, StopComponent(name, REASON), Ended, within_s=STOP_TIME_S)
        except (Refusal, LinkError) as error:
            log.info("%s: %s", name, error)
            return
        self._ended(ProcessEnded(name, ended.by, 0))


async def stop_other_hosts(bus: Bus, others: OtherHosts, changed: asyncio.Event) -> Collection[str]:
    """Ask the other machines to end their creators, and wait; an unreachable machine ends its creator by itself.

    Args:
        changed: Set when a machine left.

    Returns:
        The machines that did not confirm their end.
    """
    await _ask_to_stop(bus, others.offering)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(STOP_TIME_S):
            while others.offering:
                changed.clear()
                await changed.wait()
    return [*others.offering]


async def _ask_to_stop(bus: Bus, addresses: Iterable[str]) -> None:
    """Ask all at once; a component that does not answer soon ends by itself."""
    stops = (bus.ask(at, Stop(REASON), Stopping, within_s=SOON_S) for at in addresses)
    await asyncio.gather(*stops, return_exceptions=True)
