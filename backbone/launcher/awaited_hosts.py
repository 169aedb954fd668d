"""What the end of a mission waits for: hosts that are cut off and may still run components."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from backbone.bus.interface import Clock
from backbone.creator.messages import CUT_OFF_ENDS_WITHIN_S
from backbone.launcher.other_hosts import OtherHosts


def awaited_hosts(others: OtherHosts, clock: Clock) -> str:
    """Return one line for people; empty: no such host."""
    hosts = others.lost_since(clock.now_s() - CUT_OFF_ENDS_WITHIN_S * clock.rate)
    if not hosts:
        return ""
    names = ", ".join(hosts)
    return f"waits up to {CUT_OFF_ENDS_WITHIN_S:g} s until what runs on {names} has ended: no order gets there"


async def announce_awaited_hosts(
    others: OtherHosts, clock: Clock, changed: asyncio.Event, announce: Callable[[str], None]
) -> None:
    """Announce the hosts that are awaited now, and others after each change, until cancelled."""
    said = ""
    while True:
        changed.clear()
        if (awaited := awaited_hosts(others, clock)) and awaited != said:
            announce(said := awaited)
        await changed.wait()
