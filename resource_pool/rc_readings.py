"""Readings of RCs: ask for the newest ones, or subscribe to them."""

from __future__ import annotations

from collections.abc import Callable

from backbone.bus.interface import Bus, Subscription
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from resource_pool.messages import AskReadings, Readings

REPLY_TIME_S = 1.0  # chosen: an RC answers from its memory


async def ask_readings(bus: Bus, rc: str) -> Readings:
    """Return the newest readings that an RC has; the RC does not ask its robot.

    Raises:
        UnknownMessage: The RC reads no replies.
        LinkError: The RC did not answer.
    """
    return await bus.ask(address(Subsystem.RESOURCE_POOL, rc), AskReadings(), Readings, within_s=REPLY_TIME_S)


def watch_readings(bus: Bus, listener: Callable[[Readings], None], rc: str = "*") -> Subscription:
    """Call the listener with the readings of this RC, or of all RCs, at most twice a second for each RC."""
    at = f"{Subsystem.RESOURCE_POOL}/{rc}"
    return bus.subscribe(at, Conversation.READINGS, Readings, lambda heard: listener(heard.body))
