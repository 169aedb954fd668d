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
        clock: The mission's clock.
        owner: Address of the decision process.
        state: Returns the ARC's state, which the ARC sends to the owner with each heartbeat question.
        end: Ends the ARC for this reason.
        note: Subject, event → the story.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        owner: str,
        *,
        state: Callable[[], ArcState],
        end: Callable[[str], object],
        note: Callable[[str, str], object],
    ) -> None:
        self._bus, self._clock, self._owner = bus, clock, owner
        self._state, self._end, self._note = state, end, note
        self._renewed = asyncio.Event()

    def leases_renewed(self) -> None:
        """Schedule the next heartbeat soon."""
        self._renewed.set()

    async def watch(self) -> None:
        """End the ARC when its owner is gone."""
        owner = PeerMonitor(self._bus, self._owner, gone_after_s=OWNER_GONE_S)
        try:
            await owner.wait_gone()
        finally:
            owner.close()
        self._end(f"its owner {self._owner} is gone")

    async def beat(self) -> None:
        """Publish a heartbeat after each renewal of leases, while this ARC and its owner live."""
        arc = component_of(self._bus.source)
        place_s = crc32(arc.encode()) % 1000 / 1000 * BEAT_SPREAD_S
        while True:
            self._renewed.clear()
            try:
                await self._bus.ask(self._owner, AskBeat(self._state()), Noted, within_s=OWNER_BEAT_S)
            except (NotMyArc, UnknownMessage) as refusal:
                self._end(f"its owner does not know it: {refusal.detail}")
            except (LinkError, Refusal) as error:  # also of a hook of the owner, which has learned the ARC's state
                self._note(self._owner, f"does not answer: {error}")
            else:
                self._bus.publish(self._bus.source, Conversation.BEAT, Beat(arc))
            if await set_within(self._renewed, BEAT_WITHIN_S):
                await self._clock.sleep_s(place_s * self._clock.rate)
