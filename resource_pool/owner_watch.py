"""An ARC's watch over its owner: the ARC ends with its owner, and publishes a heartbeat with each renewal of leases."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from zlib import crc32

from backbone.bus.interface import Bus, Clock
from backbone.component.peer_monitor import PeerMonitor
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import component_of
from backbone.rc_manager.messages import BEAT_WITHIN_S, Beat
from backbone.waiting import set_within
from backbone.wire import UnknownMessage
from resource_pool.arc_listener import NotMyArc
from resource_pool.messages import ArcState, AskBeat, Noted

OWNER_GONE_S = 0.5  # chosen: if a console dies, its robot is free within a second; a new hub is found sooner
OWNER_BEAT_S = 0.9  # chosen: an owner that answers later has missed a heartbeat; less than the RC manager's limit
BEAT_SPREAD_S = 0.2  # chosen: all ARCs get a renewal at once; their owners and the hub answer a few at a time


class OwnerWatch:
    """Watches the owner of one ARC.

    Args:
        bus: For questions and heartbeats.
        owner: Address of the decision process.
        note: Subject, event → the story.
    """

    def __init__(self, bus: Bus, clock: Clock, owner: str, note: Callable[[str, str], object]) -> None:
        self._bus, self._clock, self._owner, self._note = bus, clock, owner, note
        self._place_s = crc32(component_of(bus.source).encode()) % 1000 / 1000 * BEAT_SPREAD_S
        self._renewed = asyncio.Event()

    def leases_renewed(self) -> None:
        """Schedule the next heartbeat soon."""
        self._renewed.set()

    async def wait_gone(self) -> str:
        """Wait until the owner is gone; return that as the reason for which the ARC ends."""
        owner = PeerMonitor(self._bus, self._owner, gone_after_s=OWNER_GONE_S)
        try:
            await owner.wait_gone()
        finally:
            owner.close()
        return f"its owner {self._owner} is gone"

    async def beat(self, state: ArcState) -> str:
        """Publish a heartbeat if the owner answers; return why the ARC must end, or an empty text.

        Args:
            state: The ARC's present state, which the owner gets with the question.
        """
        self._renewed.clear()
        try:
            await self._bus.ask(self._owner, AskBeat(state), Noted, within_s=OWNER_BEAT_S)
        except (NotMyArc, UnknownMessage) as refusal:
            return f"its owner does not know it: {refusal.detail}"
        except (LinkError, Refusal) as error:  # also of a hook of the owner, which has learned the ARC's state
            self._note(self._owner, f"does not answer: {error}")
        else:
            self._bus.publish(self._bus.source, Conversation.BEAT, Beat(component_of(self._bus.source)))
        return ""

    async def wait_turn(self) -> None:
        """Wait for the next renewal of leases, at most ``BEAT_WITHIN_S``, and then for this ARC's place after it."""
        if await set_within(self._renewed, BEAT_WITHIN_S):
            await self._clock.sleep_s(self._place_s * self._clock.rate)
