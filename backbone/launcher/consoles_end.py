"""The end of a mission's consoles, before its behaviors and hardware are stopped."""

from __future__ import annotations

import asyncio
import contextlib

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus
from backbone.component.messages import Stop, Stopping
from backbone.errors import LinkError
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem

ANSWER_TIME_S = 1.0  # chosen: a thousand round trips


async def stop_consoles(bus: Bus) -> None:
    """Ask every console to stop; each console releases its robot. No console is reached without a nameserver."""
    with contextlib.suppress(LinkError):
        listing = await bus.ask(
            NAMESERVER, ListComponents(subsystem=Subsystem.UI_CONSOLE), Components, within_s=ANSWER_TIME_S
        )
        stops = (
            bus.ask(console.address, Stop("the mission ends"), Stopping, within_s=ANSWER_TIME_S)
            for console in listing.components
        )
        await asyncio.gather(*stops, return_exceptions=True)
